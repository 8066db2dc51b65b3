"""The page of a replay: the verdict, every alarm unfolded, and no number that is not believed."""

import base64
import hashlib
import re

import attrs
import numpy as np
import pytest
from html_reader import read
from made_up_summary import made_up_summary

from leg_wear_monitor.playback.result import ReplayLeg, ReplayStatus, WornDepth
from leg_wear_monitor.report.page import page_html, template_text
from leg_wear_monitor.report.replay.joints import joint_rows, joint_views, leg_drawing
from leg_wear_monitor.report.replay.page import raised_alarms, replay_page
from leg_wear_monitor.state import AlarmChange, Evidence, Figure, FootLoad, Level, State

pytestmark = pytest.mark.plain

MOST_BYTES = 2_000_000


def html_of(summary):
    return page_html(replay_page(summary))


def page_of(summary):
    return read(html_of(summary))


def doubted(*figures, **changes):
    summary = made_up_summary()
    if Figure.CLEARANCES in figures:  # nothing else is known of B
        unknown = attrs.evolve(summary.clearances["B"], believed_m=None, believed_by=None)
        summary = attrs.evolve(summary, clearances={**summary.clearances, "B": unknown})
    return attrs.evolve(summary, verdict=attrs.evolve(summary.verdict, not_valid=figures, **changes))


def greyed(page):
    return page.inside(lambda _, classes: "not-valid" in classes.split())


def visible(page):
    """Texts outside of what is folded, and of scripts and styles."""
    hidden = {"details", "script", "style", "noscript"}
    return " ".join(
        data for places, data in page.places if not hidden & {tag for tag, _ in places} and data.strip()
    )


def test_the_first_screen_has_verdict_joints_belief_and_alarms():
    text = visible(page_of(made_up_summary()))
    for words in ("INSPECT", "joint A", "why", "Do", "do", "Are these values valid?", "clearance A"):
        assert words in text
    assert "Clearance over time" not in text


def test_the_first_screen_has_the_load_of_a_leg_that_carries_one():
    load = FootLoad(source="estimated", peak_n=289.4, peak_sigma_n=70.2, cycles=50)
    text = visible(page_of(attrs.evolve(made_up_summary(), load=load)))
    assert "Estimated from the drive torque: 289 ± 70 N at its peak." in text
    measured = attrs.evolve(load, source="measured", peak_sigma_n=None)
    assert "Measured: 289 N at its peak." in visible(page_of(attrs.evolve(made_up_summary(), load=measured)))
    assert "Foot load" not in visible(page_of(attrs.evolve(made_up_summary(), load=FootLoad())))


@pytest.mark.parametrize(("mismatch", "answer"), [(0.05, "✓ yes"), (0.22, "▲ in part")])
def test_a_model_that_explains_too_little_is_not_said_to_be_valid(mismatch, answer):
    torque = ReplayStatus(name="torque", level=Level.OK, message="m", values={"mismatch": mismatch})
    text = visible(page_of(attrs.evolve(doubted(), status=(torque,))))
    assert f"Model: {answer}" in " ".join(text.split())


def test_the_joint_that_the_verdict_names_has_the_first_row():
    for named in ("A", "B"):
        html = html_of(doubted(joints=(named,)))
        letters = re.findall(r'class="letter">(\w)<', html)
        assert letters == [named, *({"A", "B"} - {named})]


def test_the_banner_leads_from_the_code_to_its_guide():
    page = page_of(made_up_summary())
    assert "CLEARANCE_CHANGED_A" in visible(page)
    guide = next(link["href"] for link in page.of("a") if link["href"].startswith("#guide"))
    assert guide == "#guide-a-clearance-differs-from-the-counted-one"
    assert [place for place in page.of("details") if place.get("id") == guide[1:]]
    inside = " ".join(
        text
        for places, text in page.places
        if any(tag == "div" and classes == "guide" for tag, classes in places)
    )
    assert "Rock the named joint by hand" in inside and "radial clearance" in inside


def test_nothing_in_the_page_leads_to_a_file_that_may_not_be_there():
    page = page_of(made_up_summary())
    hrefs = [link["href"] for link in page.of("a") if "download" not in link]
    assert hrefs and all(href.startswith(("#", "https://")) for href in hrefs)
    anchors = {place.get("id") for tag in ("section", "details", "h2") for place in page.of(tag)}
    assert {href[1:] for href in hrefs if href.startswith("#")} <= anchors


def test_the_certainty_leads_to_what_it_was_measured_on():
    page = page_of(made_up_summary())
    assert "99 of 100 such findings are right on simulated legs" in visible(page)
    assert any(link["href"] == "#how-sure-is-the-verdict" for link in page.of("a"))
    assert "577 of 580" in " ".join(page.texts)


@pytest.mark.parametrize("state", State)
def test_every_state_has_a_symbol_a_word_and_a_colour(state):
    page = page_of(doubted(state=state))
    (banner,) = (place for place in page.of("div") if "banner" in place.get("class", "").split())
    assert banner["class"].split()[1] in {"fine", "careful", "bad"}
    (verdict,) = {
        "".join(part for places, part in page.places if ("p", "verdict") in places).strip() for _ in "1"
    }
    assert state.words.upper() in verdict and verdict[0] in "✓◆?▲■"


def test_every_raised_alarm_is_unfolded_with_its_level():
    summary = made_up_summary()
    alarm = summary.alarms.now[0]
    names = ["impact_force A", "growth B", "torque_mismatch", "input_rate crank"]
    raised = tuple(attrs.evolve(alarm, name=name, level=Level.ERROR) for name in names)
    quiet = attrs.evolve(alarm, name="input_gaps", level=Level.OK)
    text = visible(page_of(attrs.evolve(summary, alarms=attrs.evolve(summary.alarms, now=(*raised, quiet)))))
    for name in ("impact_force A", "growth B (knee)", "torque_mismatch", "input_rate crank"):
        assert f"ERROR {name}" in re.sub(r"\s+", " ", text)
    assert "ERROR impact_force" in text and "ERROR growth" in text
    assert "input_gaps" not in text


@pytest.mark.parametrize("by", ["believed", "seen"])
def test_the_last_estimate_of_a_clearance_is_not_called_the_worst(by):
    """Also where the verdict rests on what somebody measured since."""
    values = {"believed_m": 3e-4, "believed_by": "measured", "seen_m": None, "seen_by": ()}
    values |= {f"{by}_m": 1.65e-3, f"{by}_by": "torque" if by == "believed" else ("torque",)}
    summary = doubted()
    clearances = summary.clearances | {"A": attrs.evolve(summary.clearances["A"], **values)}
    alarm = {"name": "clearance A", "level": Level.ERROR, "worst": 1.65e-3, "limit": 6e-4, "unit": "m"}
    now = (attrs.evolve(summary.alarms.now[0], **alarm),)
    alarms = attrs.evolve(summary.alarms, now=now)
    words = raised_alarms(attrs.evolve(summary, clearances=clearances, alarms=alarms), otherwise="")
    assert "last estimate 1.65 mm, limit 0.6 mm" in words and "worst" not in words


def test_what_the_verdict_gives_as_its_reason_is_not_hidden_beside_the_alarm():
    summary = doubted(
        Figure.IMPACT_FORCES, Figure.GROWTH, evidence=(Evidence("impact_force A", 1e4, 5e3, "N"),)
    )
    alarm, unit = summary.alarms.now[0], {"level": Level.ERROR, "worst": 1e4, "limit": 5e3, "unit": "N"}
    raised = tuple(attrs.evolve(alarm, name=name, **unit) for name in ("impact_force A", "impact_force B"))
    summary = attrs.evolve(summary, alarms=attrs.evolve(summary.alarms, now=raised))
    of_a, of_b = re.findall("<li.*?</li>", raised_alarms(summary, otherwise=""))
    assert "worst 10000 N" in of_a and "not valid" not in of_a
    assert "worst" not in of_b and "not valid" in of_b
    assert "impact forces: see the verdict" not in visible(page_of(summary))  # in the verdict itself


def test_what_the_verdict_does_not_believe_is_greyed_and_no_number():
    summary = doubted(*Figure, joints=())
    seen = attrs.evolve(summary.clearances["A"], seen_by=("torque",), believed_by="torque")
    clearances = {**summary.clearances, "A": seen}
    joints = {name: attrs.evolve(joint, encoders=None) for name, joint in summary.joints.items()}
    page = page_of(attrs.evolve(summary, clearances=clearances, joints=joints))
    texts = [data for data in greyed(page) if data.strip()]
    assert len(texts) >= 8
    assert all(
        text.strip().removeprefix("counted ").lower().startswith(("not valid", "counted clear"))
        for text in texts
    )
    assert not any(character.isdigit() for text in texts for character in text)
    text = visible(page) + " ".join(page.inside(lambda tag, _: tag == "td"))
    assert "estimated 0.500 ± 0.010 mm by the drive torque" in text  # that does not rest on the counted one
    for number in ("0.400 mm", "9.00", "1e-", "pm/cycle"):
        assert number not in text
    assert not [link for link in page.of("a") if link.get("download") in {"forces.csv", "clearances.csv"}]


@pytest.mark.parametrize(
    ("figure", "file"), [(Figure.CLEARANCES, "clearances.csv"), (Figure.IMPACT_FORCES, "forces.csv")]
)
def test_a_chart_of_what_is_believed_is_there_and_else_is_not(figure, file):
    for invalid in ((), (figure,)):
        files = [link.get("download") for link in page_of(doubted(*invalid)).of("a")]
        assert (file in files) is not bool(invalid)


def test_a_seen_clearance_is_given_where_the_counted_one_is_not():
    text = visible(page_of(doubted(*Figure)))
    assert "estimated 0.500 ± 0.010 mm by the joint encoders" in text
    assert "counted not valid: leg differs from its model" in text
    assert "counted 0" not in text.partition("Clearances are radial")[0]


def test_a_clearance_measured_by_hand_has_a_mark_on_its_bar():
    summary = made_up_summary()
    measured = {"believed_m": 2.0e-3, "believed_sigma_m": 5.0e-5, "believed_by": "measured"}
    clearances = {
        joint: attrs.evolve(one, seen_m=None, seen_sigma_m=None, **(measured if joint == "A" else {}))
        for joint, one in summary.clearances.items()
    }
    views = joint_views(attrs.evolve(summary, clearances=clearances))
    rows = joint_rows(summary, views)
    assert rows.count('<rect class="seen"') == 1
    assert "bars from 0 to 2.14 mm" in rows


def test_the_marks_of_the_drawing_say_how_much_of_the_limit_is_used():
    page = page_of(doubted())
    drawing = next(svg for svg in page.of("svg") if svg.get("role") == "img")
    assert drawing["aria-label"] == "The leg leg: joint A 67 % used; joint B (knee) 33 % used"
    drawing = next(svg for svg in page_of(doubted(*Figure)).of("svg") if svg.get("role") == "img")
    assert drawing["aria-label"] == "The leg leg: joint A 67 % used; joint B (knee) not valid"


@pytest.mark.parametrize("label", ["hip bearing, thigh side, outer", "M" * 30, "knee", ""])
def test_a_long_label_has_several_lines_beside_the_drawing(label):
    """It ended at the edge of the drawing, without the part that tells two bearings apart."""
    summary = made_up_summary()
    joints = {name: attrs.evolve(joint, label=label) for name, joint in summary.leg.joints.items()}
    summary = attrs.evolve(summary, leg=attrs.evolve(summary.leg, joints=joints))
    drawn = leg_drawing(summary, joint_views(summary))
    lines = re.findall(r'<tspan class="label"[^>]*>([^<]*)<', drawn)
    assert max(map(len, lines), default=0) <= 17
    assert "".join(lines).replace(" ", "") == 2 * label.replace(" ", "")
    rows = [float(y) for y in re.findall(r'<text class="(?:name|words)" x="[\d.]+" y="([\d.]+)"', drawn)]
    assert min(np.diff(rows)) >= 16.9  # one below the other


def test_a_summary_without_the_leg_s_shape_has_a_page():
    page = page_of(attrs.evolve(made_up_summary(), leg=ReplayLeg()))
    assert "does not contain the leg's shape" in visible(page)


def test_whatever_the_names_are_they_stay_texts():
    summary, evil = made_up_summary(), "</script><b onclick=x>&\"'"
    joints = {name: attrs.evolve(joint, label=evil) for name, joint in summary.leg.joints.items()}
    alarm = attrs.evolve(summary.alarms.now[0], name=f"clearance {evil}")
    strange = attrs.evolve(
        summary,
        leg=attrs.evolve(summary.leg, joints=joints),
        monitor=attrs.evolve(summary.monitor, hardware_id=evil, mechanism=evil),
        verdict=attrs.evolve(summary.verdict, why=evil, do=evil, joints=(evil,), not_valid=()),
        alarms=attrs.evolve(summary.alarms, now=(alarm,), changes=(AlarmChange(stamp_ns=4, alarm=alarm),)),
    )
    plain, page = page_of(doubted()), page_of(strange)
    assert {tag for tag, _ in page.elements} == {tag for tag, _ in plain.elements}
    assert not any("onclick" in attributes for _, attributes in page.elements)
    assert len(page.of("script")) == len(plain.of("script"))


def test_only_the_page_s_own_scripts_may_run_and_nothing_is_fetched():
    html = html_of(doubted())
    page = read(html)
    (policy,) = (meta["content"] for meta in page.of("meta") if "http-equiv" in meta)
    allowed = re.search(r"script-src (.*)$", policy)[1].split()
    scripts = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    assert allowed == [f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests]
    assert len(scripts) == 3 and policy.startswith("default-src 'none';")
    for element, attributes in page.elements:
        for name in ("src", "href"):
            own = ("data:", "#", "file:") if element == "a" else ("data:", "#")  # a link to the guide
            assert attributes.get(name, "data:").startswith(own), element
        assert not any(name.startswith("on") for name in attributes), element
    html = html.replace('"http://www.w3.org/2000/svg"', "")  # a name, which nobody asks for
    for library in ("uplot/uPlot.iife.min.js", "uplot/uPlot.min.css"):
        html = html.replace(template_text(library), "")
    assert "http:" not in html and "https:" not in html and "@import" not in html


def test_the_longest_page_of_many_joints_is_small():
    rows, joints = 1000, [f"J{k}" for k in range(12)]
    summary, noise = doubted(), np.random.default_rng(5)
    history = attrs.asdict(summary.history, recurse=False)
    columns = {
        name: {joint: noise.normal(size=rows) for joint in joints}
        if isinstance(column, dict)
        else noise.normal(size=rows)
        for name, column in history.items()
    } | {"stamp_ns": summary.recording.begin_ns + np.arange(rows) * 10**12}
    alarm = summary.alarms.now[0]
    changes = tuple(
        AlarmChange(stamp_ns=10**15 * k, alarm=attrs.evolve(alarm, name=f"clearance {joints[k % 12]}"))
        for k in range(10_000)
    )
    depths = {joint: WornDepth(noise.random(360), noise.random(360)) for joint in joints}
    big = attrs.evolve(
        summary,
        monitor=attrs.evolve(summary.monitor, clearance_joints=tuple(joints)),
        joints=dict.fromkeys(joints, summary.joints["A"]),
        clearances=dict.fromkeys(joints, summary.clearances["A"]),
        history=attrs.evolve(summary.history, **columns),
        alarms=attrs.evolve(summary.alarms, changes=changes),
        wear_depth_m=depths,
    )
    assert 500_000 < len(html_of(big).encode()) < MOST_BYTES


def test_a_thinned_history_is_drawn_with_its_range():
    summary = doubted()
    history = summary.history
    ends = {"torque_mismatch": np.array([0.1, 7.0])}
    thin = attrs.evolve(history, lowest={"torque_mismatch": np.zeros(2)}, highest=ends)
    (chart,) = (
        part
        for section in replay_page(attrs.evolve(summary, history=thin)).sections
        for part in section.parts
        if getattr(part, "name", "") == "input"
    )
    columns = {series.head: series.values.tolist() for series in chart.columns}
    assert columns["mismatch, lowest"] == [0.0, 0.0] and columns["mismatch, highest"] == [0.1, 7.0]
    (panel,) = (panel for panel in chart.panels if "not explained" in panel.title)
    assert panel.low == 0.0 and panel.high == 7.0


def test_equal_summaries_give_equal_bytes():
    assert html_of(made_up_summary()) == html_of(made_up_summary())


# --- colours ---


def palettes():
    """Colours by their variables, light and dark."""
    css = template_text("page.css").partition("@media")[0] + template_text("replay/replay.css")
    light, _, rest = css.partition("@media screen and (prefers-color-scheme: dark)")
    dark = rest[: rest.index("}")]
    found = re.compile(r"--([a-z0-9-]+): (#[0-9a-f]{6})")
    palette = dict(found.findall(light))
    return {"light": palette, "dark": palette | dict(found.findall(dark))}


def luminance(colour):
    """Relative luminance, WCAG 2.2."""
    parts = (int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    linear = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def contrast(one, other):
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("name", ["light", "dark"])
def test_texts_and_curves_stand_out_from_their_ground(name):
    palette = palettes()[name]
    assert luminance(palette["paper"]) > 0.9 or name == "dark"
    for ground in ("paper", "wash"):
        for text in ("ink", "soft", "fine", "careful", "bad", "grey", "blue"):
            assert contrast(palette[text], palette[ground]) >= 4.5, (text, ground)
    for k in range(7):
        assert contrast(palette[f"series-{k}"], palette["paper"]) >= 3.0, k
    for look in ("fine", "careful", "bad"):
        fill = re.search(
            rf"\.banner\.{look} {{[^}}]*--fill: (#[0-9a-f]{{6}})", template_text("replay/replay.css")
        )
        assert contrast(fill[1], "#ffffff") >= 4.5
