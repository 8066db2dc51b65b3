"""Records of an MCAP chunk, found in one pass over its bytes (https://mcap.dev/spec)."""

import numpy as np

from leg_wear_monitor.kernel import entry, kernel

SCHEMA, CHANNEL, MESSAGE_RECORD, CHUNK, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F
RECORD_HEAD = 9  # opcode and length
_MESSAGE_HEAD = 22  # channel, sequence, log time, publish time

UNKNOWN, IGNORED = 0, 255
"""Roles of a channel beside the codes of streams: not defined in the file, and not asked for."""

COUNTS = np.dtype(
    [
        ("wanted", "i8"),
        ("definitions", "i8"),
        ("unknown_channel", "i8"),
        ("foreign", "i8"),
        ("first_log_time_ns", "i8"),
        ("last_log_time_ns", "i8"),
        ("read", "i8"),
    ]
)
"""What a walk met: messages asked for, schemas and channels, messages of no channel, records of no known
kind, the range of log times of all messages, and how many bytes hold whole records."""


@kernel
def unsigned(data, at, size):
    """Little-endian integer of up to eight bytes; what does not fit into int64 is its largest."""
    value = np.int64(0)
    for i in range(size - 1):
        value |= np.int64(data[at + i]) << (8 * i)
    top = np.int64(data[at + size - 1])
    if size == 8 and top >= 128:
        return np.int64(2**63 - 1)
    return value | top << (8 * (size - 1))


@entry
def walk(data, roles, out_messages, out_definitions, out_counts):
    """Find messages and definitions among records; give what was met.

    Parameters
    ----------
    data : (bytes,) array of uint8
    roles : (65536,) array of uint8
        What a channel's messages are, by its number: `UNKNOWN`, `IGNORED` or a stream's code.
    out_messages : (any,) array of MESSAGE
        Messages asked for, as many as fit; empty to count them only.
    out_definitions : (any,) array of int64
        Positions of schemas and channels, as many as fit.
    out_counts : (1,) array of COUNTS
    """
    at, end = np.int64(0), np.int64(data.shape[0])
    wanted, definitions, unknown, foreign = np.int64(0), np.int64(0), np.int64(0), np.int64(0)
    first, last = np.int64(2**63 - 1), np.int64(-1)
    while at + RECORD_HEAD <= end:
        opcode, length = data[at], unsigned(data, at + 1, 8)
        body = at + RECORD_HEAD
        if length > end - body or opcode in (CHUNK, DATA_END):
            break
        if opcode == MESSAGE_RECORD and length >= _MESSAGE_HEAD:
            log_time = unsigned(data, body + 6, 8)
            first, last = min(first, log_time), max(last, log_time)
            role = roles[unsigned(data, body, 2)]
            if role == UNKNOWN:
                unknown += 1
            elif role != IGNORED:
                if wanted < out_messages.shape[0]:
                    out_messages[wanted]["begin"] = body + _MESSAGE_HEAD
                    out_messages[wanted]["end"] = body + length
                    out_messages[wanted]["log_time_ns"] = log_time
                    out_messages[wanted]["publish_time_ns"] = unsigned(data, body + 14, 8)
                    out_messages[wanted]["type"] = role
                wanted += 1
        elif opcode in (SCHEMA, CHANNEL):
            if definitions < out_definitions.shape[0]:
                out_definitions[definitions] = at
            definitions += 1
        elif opcode < 0x80:  # above are private records, which may stand anywhere
            foreign += 1
        at = body + length
    out_counts[0]["wanted"] = wanted
    out_counts[0]["definitions"] = definitions
    out_counts[0]["unknown_channel"] = unknown
    out_counts[0]["foreign"] = foreign
    out_counts[0]["first_log_time_ns"] = first
    out_counts[0]["last_log_time_ns"] = last
    out_counts[0]["read"] = at
