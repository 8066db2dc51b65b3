"""A message type that no installed package has, for subscriptions and publishers of serialized messages.

rclpy passes a type to the middleware as a pointer to C structures, which the package of a message contains as
a library. Of these, serialized messages need the names, the hash and two descriptions only; they are laid out
here as in rosidl_runtime_c, rosidl_typesupport_fastrtps_cpp and rosidl_typesupport_introspection_c of ROS 2
Jazzy, for Fast DDS.
"""

import ctypes
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import attrs
from rclpy.utilities import get_rmw_implementation_identifier

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.messages.streams import definition, types

_FAST_DDS = "rmw_fastrtps_cpp"
_INTROSPECTION = "rosidl_typesupport_introspection_c"
_OF_FAST_DDS = b"rosidl_typesupport_fastrtps_c"
_UNBOUNDED = b"\x00"


class _Text(ctypes.Structure):
    """rosidl_runtime_c__String."""

    _fields_ = (("data", ctypes.c_char_p), ("size", ctypes.c_size_t), ("capacity", ctypes.c_size_t))


class _Many(ctypes.Structure):
    """A sequence of anything."""

    _fields_ = (("data", ctypes.c_void_p), ("size", ctypes.c_size_t), ("capacity", ctypes.c_size_t))


class _FieldType(ctypes.Structure):
    _fields_ = (
        ("type_id", ctypes.c_uint8),
        ("capacity", ctypes.c_uint64),
        ("string_capacity", ctypes.c_uint64),
        ("nested_type_name", _Text),
    )


class _Field(ctypes.Structure):
    _fields_ = (("name", _Text), ("type", _FieldType), ("default_value", _Text))


class _OneType(ctypes.Structure):
    """IndividualTypeDescription."""

    _fields_ = (("type_name", _Text), ("fields", _Many))


class _Description(ctypes.Structure):
    """TypeDescription."""

    _fields_ = (("type_description", _OneType), ("referenced_type_descriptions", _Many))


class _Source(ctypes.Structure):
    """TypeSource."""

    _fields_ = (("type_name", _Text), ("encoding", _Text), ("raw_file_contents", _Text))


class _Hash(ctypes.Structure):
    """rosidl_type_hash_t."""

    _fields_ = (("version", ctypes.c_uint8), ("value", ctypes.c_uint8 * 32))


_GET = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)
_FIND = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)
_LARGEST = ctypes.CFUNCTYPE(ctypes.c_size_t, ctypes.POINTER(ctypes.c_char))


class _Callbacks(ctypes.Structure):
    """message_type_support_callbacks_t; those for messages that are not serialized yet are null."""

    _fields_ = (
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("serialize", ctypes.c_void_p),
        ("deserialize", ctypes.c_void_p),
        ("get_serialized_size", ctypes.c_void_p),
        ("max_serialized_size", _LARGEST),
        ("key_callbacks", ctypes.c_void_p),
    )


class _Member(ctypes.Structure):
    """MessageMember; without the places in memory, which serialized messages do not have."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("type_id", ctypes.c_uint8),
        ("string_upper_bound", ctypes.c_size_t),
        ("members", ctypes.c_void_p),
        ("is_key", ctypes.c_bool),
        ("is_array", ctypes.c_bool),
        ("array_size", ctypes.c_size_t),
        ("is_upper_bound", ctypes.c_bool),
        ("offset", ctypes.c_uint32),
        ("default_value", ctypes.c_void_p),
        ("functions", ctypes.c_void_p * 6),
    )


class _Members(ctypes.Structure):
    """MessageMembers."""

    _fields_ = (
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("member_count", ctypes.c_uint32),
        ("size_of", ctypes.c_size_t),
        ("has_any_key_member", ctypes.c_bool),
        ("members", ctypes.c_void_p),
        ("functions", ctypes.c_void_p * 2),
    )


class _TypeSupport(ctypes.Structure):
    """rosidl_message_type_support_t."""

    _fields_ = (
        ("identifier", ctypes.c_void_p),
        ("data", ctypes.c_void_p),
        ("find", _FIND),
        ("get_hash", _GET),
        ("get_description", _GET),
        ("get_sources", _GET),
    )


# Of the constants of FieldType, a sequence is 144 further; and of those of the introspection.
_NESTED, _SEQUENCE = "message", 144
_TYPE_IDS = {_NESTED: (1, 18), "int32": (6, 13), "uint32": (7, 12), "float64": (11, 2), "string": (17, 16)}


@attrs.frozen
class _Part:
    """A field of a message.

    Attributes
    ----------
    name : str
    kind : str
        A key of `_TYPE_IDS`.
    nested : str
        Type of a message; empty otherwise.
    is_sequence : bool
    """

    name: str
    kind: str
    nested: str
    is_sequence: bool


def _parts(name: str) -> list[_Part]:
    parts, fields = [], types().fielddefs[name][1]
    content: Any
    for field, (node, content) in fields:
        is_sequence = node.name == "SEQUENCE"
        kind, base = content[0] if is_sequence else (node, content)
        nested = str(base) if kind.name == "NAME" else ""
        parts.append(_Part(field, _NESTED if nested else str(base[0]), nested, is_sequence))
    return parts


def _nested(name: str) -> list[str]:
    """Types of the messages in a message, in their order."""
    found = {part.nested for part in _parts(name) if part.nested}
    return sorted(found.union(*map(_nested, found)))


def type_description(name: str) -> dict[str, Any]:
    """Description of a message type whose fields are numbers, texts, messages, and sequences of these.

    Parameters
    ----------
    name : str
        Message type, such as ``control_msgs/msg/DynamicJointState``.

    Returns
    -------
    dict
        As REP-2016 defines it: the hash of a type is that of this description as JSON.
    """

    def described(one: str) -> dict[str, Any]:
        fields = []
        for part in _parts(one):
            number = _TYPE_IDS[part.kind][0] + _SEQUENCE * part.is_sequence
            kind = {"type_id": number, "capacity": 0, "string_capacity": 0, "nested_type_name": part.nested}
            fields.append({"name": part.name, "type": kind})
        return {"type_name": one, "fields": fields}

    return {
        "type_description": described(name),
        "referenced_type_descriptions": [described(one) for one in _nested(name)],
    }


def _text(text: str) -> _Text:
    data = text.encode()
    return _Text(data, len(data), len(data) + 1)


def _many(kind: type[ctypes.Structure], items: Sequence[ctypes.Structure], kept: list[object]) -> _Many:
    """A sequence of structures, whose memory is added to what is kept."""
    array = (kind * len(items))(*items)
    kept.append(array)
    return _Many(ctypes.addressof(array) if items else None, len(items), len(items))


def _one_type(described: Mapping[str, Any], kept: list[object]) -> _OneType:
    fields = []
    for field in described["fields"]:
        of = field["type"]
        kind = _FieldType(of["type_id"], of["capacity"], of["string_capacity"], _text(of["nested_type_name"]))
        fields.append(_Field(_text(field["name"]), kind, _text("")))
    return _OneType(_text(described["type_name"]), _many(_Field, fields, kept))


def _getter(of: ctypes.Structure) -> Any:
    """C function that gives the address of a structure."""
    at = ctypes.addressof(of)
    return _GET(lambda _: at)


def _introspection(name: str, kept: list[object]) -> _TypeSupport:
    """What the middleware asks for the fields of a type."""
    members = []
    for part in _parts(name):
        nested = ctypes.addressof(_introspection(part.nested, kept)) if part.nested else None
        members.append(
            _Member(
                name=part.name.encode(),
                type_id=_TYPE_IDS[part.kind][1],
                members=nested,
                is_array=part.is_sequence,
            )
        )
    array = (_Member * len(members))(*members)
    package, folder, message = name.split("/")
    data = _Members(
        namespace=f"{package}__{folder}".encode(),
        name=message.encode(),
        member_count=len(members),
        members=ctypes.addressof(array),
    )
    # compared by its address
    identifier = ctypes.c_void_p.in_dll(
        ctypes.CDLL(f"lib{_INTROSPECTION}.so"), f"{_INTROSPECTION}__identifier"
    )
    itself = _FIND(lambda support, wanted: support if wanted == _INTROSPECTION.encode() else None)
    support = _TypeSupport(identifier.value, ctypes.addressof(data), itself)
    kept += [array, data, support]
    return support


def _type_support(name: str) -> _TypeSupport:
    """C structures of a message type; they refer to each other and stay for as long as the process."""
    kept: list[object] = []
    described = type_description(name)
    others = [_one_type(each, kept) for each in described["referenced_type_descriptions"]]
    description = _Description(_one_type(described["type_description"], kept), _many(_OneType, others, kept))
    source = _Source(_text(name), _text("dynamic"), _text(""))
    sources = _many(_Source, [source], kept)
    version, _, digits = definition(name).digest.removeprefix("RIHS").partition("_")
    digest = _Hash(int(version), (ctypes.c_uint8 * 32)(*bytes.fromhex(digits)))
    introspection = ctypes.addressof(_introspection(name, kept))

    @_LARGEST
    def largest(out_bounds: Any) -> int:
        out_bounds[0] = _UNBOUNDED
        return 0

    @_FIND
    def find(support: int, identifier: bytes) -> int | None:
        return {_OF_FAST_DDS: support, _INTROSPECTION.encode(): introspection}.get(identifier)

    package, folder, message = name.split("/")
    callbacks = _Callbacks(
        namespace=f"{package}::{folder}".encode(), name=message.encode(), max_serialized_size=largest
    )
    identifier = ctypes.create_string_buffer(_OF_FAST_DDS)
    support = _TypeSupport(
        ctypes.addressof(identifier),
        ctypes.addressof(callbacks),
        find,
        *map(_getter, (digest, description, sources)),
    )
    _KEPT.append((kept, description, sources, digest, callbacks, identifier, support))
    return support


_KEPT: list[object] = []
"""What the middleware has pointers to."""


@cache
def generated_class(name: str) -> Any:
    """Class for rclpy's `create_subscription` with `raw`, and for publishers of bytes.

    Parameters
    ----------
    name : str
        Message type, such as ``control_msgs/msg/DynamicJointState``.

    Raises
    ------
    LegWearError
        If the middleware is not Fast DDS.
    """
    package, _, message = name.split("/")
    middleware = get_rmw_implementation_identifier()
    if middleware != _FAST_DDS:
        raise LegWearError(
            f"{name}: the package {package} is not installed, and {middleware} needs it; install it "
            f"(apt install ros-jazzy-{package.replace('_', '-')}) or use {_FAST_DDS}"
        )
    capsule = ctypes.pythonapi.PyCapsule_New
    capsule.restype, capsule.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)

    def refuse(*_: object) -> None:
        raise LegWearError(f"{name}: messages of a generated type are read and written as bytes only")

    kind = type(
        f"Generated_{message}",
        (type,),
        {
            "_TYPE_SUPPORT": capsule(ctypes.addressof(_type_support(name)), None, None),
            "_CREATE_ROS_MESSAGE": refuse,
            "_CONVERT_FROM_PY": refuse,
            "_CONVERT_TO_PY": refuse,
            "_DESTROY_ROS_MESSAGE": refuse,
        },
    )
    return kind(message, (), {"__module__": f"{package}.msg"})
