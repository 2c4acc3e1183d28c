"""Pictures, pages and exported files: they hold the design, the same every time, and nothing foreign."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest
from PIL import Image
from watt2_zoo import three_pose_task

from mechanisms import Design, Linkage, Task, TaskError, synthesize
from mechanisms.animation import animation_page
from mechanisms.export import export_design
from mechanisms.player import player_data
from mechanisms.plots import draw_design, save_design
from mechanisms.rails import design_rails
from mechanisms.report import report_page
from mechanisms.travel import travel

NASTY = '</script><script>alert(1)</script> & <b>"bold"</b>'


@pytest.fixture(scope="module")
def result():
    return synthesize(replace(three_pose_task(-31.70257), title=NASTY, length_unit="mm"), seed=1)


@pytest.fixture(scope="module")
def design(result):
    return result.accepted[0]


def test_travel_passes_every_pose_and_keeps_every_length(design):
    motion = travel(design, frames=200)
    assert motion.working and motion.driven == "crank"
    steps = np.diff(motion.input)
    assert np.all(steps < 0) and np.allclose(steps, steps[0])  # the example's crank turns clockwise, evenly
    for frame, pose in zip(motion.poses, design.poses):
        places = design.linkage.positions(pose)
        worst = max(abs(motion.points[name][frame] - z) for name, z in places.items())
        assert worst < 0.5  # half a step of a linkage of size 100
    first = design.linkage.points
    for names in design.linkage.links.values():
        for a in names:
            for b in names:
                lengths = np.abs(motion.points[a] - motion.points[b])
                assert np.allclose(lengths, abs(first[a] - first[b]), atol=1e-7)


def test_travel_of_a_design_with_a_defect_is_its_whole_circuit(result):
    broken = next(d for d in result.designs if "branch" in d.reasons)
    motion = travel(broken)
    assert not motion.working and len(motion) == 91


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_pictures_are_written_and_the_same_every_time(design, result, tmp_path, kind):
    for name in ("a", "b"):
        save_design(design, tmp_path / f"{name}.{kind}", result.task)
    data = (tmp_path / f"a.{kind}").read_bytes()
    assert data == (tmp_path / f"b.{kind}").read_bytes() and len(data) > 5000
    if kind == "svg":
        assert ElementTree.fromstring(data).tag.endswith("svg")
    if kind == "png":
        with Image.open(tmp_path / "a.png") as image:
            pixels = np.asarray(image.convert("RGB")).reshape(-1, 3)
        assert 20 < len(np.unique(pixels, axis=0))  # not an empty page


def test_drawing_on_axes_of_ones_own(design):
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    assert design.plot(ax) is ax
    labels = {text.get_text() for text in ax.texts}
    assert {"O1", "O3", "O4", "A1", "A2", "P0", "P2", "Q1"} <= labels
    left, right = ax.get_xlim()
    assert all(left < z.real < right for z in design.linkage.points.values())


def test_a_rejected_design_says_why_in_its_picture(result):
    broken = next(d for d in result.designs if "order" in d.reasons)
    assert "rejected, order: passes the poses in another order" in draw_design(broken).get_title(loc="left")


def test_gif_moves_there_and_back(design, result, tmp_path):
    save_design(design, tmp_path / "a.gif", result.task)
    with Image.open(tmp_path / "a.gif") as image:
        assert image.n_frames == 2 * 48 - 2 and image.info["loop"] == 0
        frames = []
        for number in (0, 24, 47, 70):
            image.seek(number)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    assert all(np.abs(frames[0] - other).max() > 100 for other in frames[1:])
    assert np.abs(frames[1] - frames[3]).max() <= 100  # frame 70 is frame 24 on the way back


def test_a_linkage_of_two_freedoms_is_shown_in_its_poses(tmp_path):
    """No input drives it, so that there is no motion between the poses to be shown."""
    links = {"ground": ["O"], "a": ["O", "A"], "b": ["A", "P"]}
    linkage = Linkage({"O": 0, "A": 1, "P": 2}, links, bodies={"P": ("b", "P")})
    poses = ({"a": 0.0, "b": 0.0}, {"a": 0.3, "b": 0.9}, {"a": 0.5, "b": 2.0})
    design = Design("D001", 0, linkage=linkage, poses=poses)
    motion = travel(design)
    assert (len(motion), motion.driven, motion.poses) == (3, "", [0, 1, 2])
    assert np.allclose(motion.points["P"], [np.exp(1j * p["a"]) + np.exp(1j * p["b"]) for p in poses])
    for kind in ("svg", "html", "gif"):
        save_design(design, tmp_path / f"d.{kind}")
    with Image.open(tmp_path / "d.gif") as image:
        assert image.n_frames >= 3
    assert '"path":false' in animation_page(design)


def test_no_linkage_no_picture(result, tmp_path):
    hopeless = next(d for d in result.designs if d.linkage is None)
    with pytest.raises(ValueError, match="is no linkage"):
        save_design(hopeless, tmp_path / "a.svg")
    with pytest.raises(ValueError, match="cannot draw"):
        save_design(result.accepted[0], tmp_path / "a.tiff")


def pages(result):
    return [animation_page(result.accepted[0], result.task), report_page(result)]


def test_pages_load_nothing_and_escape_titles(result):
    for page in pages(result):
        assert "alert(1)</script>" not in page and "<b>" not in page
        assert "&lt;/script&gt;" in page
        links = re.findall(r"""(?:src|href)\s*=\s*["']?([^"'\s>]+)""", page)
        assert all(link.startswith("#D") for link in links)
        addresses = set(re.findall(r"https?://[^\s\"']+", page))
        assert addresses <= {"http://www.w3.org/2000/svg"}
        assert "default-src 'none'" in page


def test_pages_hold_the_motion(result):
    page = pages(result)[0]
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', page, re.S)[1])
    design = result.accepted[0]
    assert data["driven"] == "crank" and data["working"] and len(data["poses"]) == 3
    assert [body["name"] for body in data["bodies"]] == ["P", "Q"]
    for name, z in design.linkage.points.items():
        assert abs(complex(data["points"][name][0][0], data["points"][name][1][0]) - z) < 0.01
    assert len(data["input"]) == len(data["points"]["A1"][0]) == len(data["bodies"][0]["angles"])


def test_report_names_every_linkage_and_stage(result):
    page = report_page(result)
    for design in result.designs:
        assert (f'id="{design.id}"' in page) == (design.linkage is not None)
    for words in ("complex roots", "no linkage at all", "a dead centre lies between poses"):
        assert words in page
    assert page.count('class="player"') == 3
    assert report_page(result, top=1).count('class="player"') == 1


def test_dxf_holds_every_link_in_true_size(design, tmp_path):
    export_design(design, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert document.header["$INSUNITS"] == 4 and not document.audit().errors
    space = document.modelspace()
    (crank,) = space.query('LWPOLYLINE[layer=="crank"]')
    corners = {complex(round(x, 6), round(y, 6)) for x, y, *_ in crank.get_points()}
    wanted = {design.linkage.points[name] for name in ("O1", "A1", "A2")}
    assert corners == {complex(round(z.real, 6), round(z.imag, 6)) for z in wanted} and crank.closed
    rocker = space.query('LWPOLYLINE[layer=="P-rocker"]').first
    (x0, y0, *_), (x1, y1, *_) = rocker.get_points()
    assert abs(complex(x1 - x0, y1 - y0)) == pytest.approx(abs(design.parameters["W3"]))
    assert {layer.dxf.name for layer in document.layers} >= {"ground", "names", "pose 0", "pose 2"}


def test_svg_is_a_drawing_in_millimetres(design, tmp_path):
    export_design(design, tmp_path / "a.svg")
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    wide = float(root.get("viewBox").split()[2])
    assert float(root.get("width").removesuffix("mm")) == pytest.approx(wide, rel=1e-5)
    space = "{http://www.w3.org/2000/svg}"
    assert {g.get("id") for g in root.iter(f"{space}g") if g.get("id")} == set(design.linkage.links)


def test_csv_holds_points_of_every_pose(design, tmp_path):
    export_design(design, tmp_path / "a.csv")
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    for number, pose in enumerate(design.poses):
        places = design.linkage.positions(pose)
        read = {
            r["name"]: complex(float(r["x"]), float(r["y"]))
            for r in rows
            if r["kind"] == "point" and r["pose"] == str(number)
        }
        assert read == {name: complex(z) for name, z in places.items()}
    lengths = {row["name"]: float(row["value"]) for row in rows if row["kind"] == "length"}
    assert lengths == design.links


SLIDING = """
mechanism = "four-bar-motion"
length_unit = "mm"
poses = [{x = 0, y = 0, angle_deg = 0}, {x = 30, y = 40, angle_deg = 20}, {x = 80, y = 55, angle_deg = 55},
         {x = 125, y = 35, angle_deg = 90}]
[constraints]
min_transmission_deg = 35.0
"""


@pytest.fixture(scope="module")
def slider_crank():
    designs = synthesize(Task.from_toml(SLIDING)).accepted
    return next(design for design in designs if design.note.startswith("slider-crank"))


def on_segment(z: complex, first: complex, last: complex) -> bool:
    """Whether z lies between the ends: the two distances add up."""
    return abs(z - first) + abs(z - last) == pytest.approx(abs(last - first), rel=1e-6)


def test_every_file_of_a_slider_crank_has_the_slide_as_long_as_its_pin_goes(slider_crank, tmp_path):
    linkage = slider_crank.linkage
    (slider,) = linkage.sliders
    pins = [complex(linkage.positions(pose)[slider.at]) for pose in slider_crank.poses]
    assert max(abs(z - pins[0]) for z in pins) > 50
    export_design(slider_crank, tmp_path / "a.dxf")
    (line,) = ezdxf.readfile(tmp_path / "a.dxf").modelspace().query('LINE[layer=="ground"]')
    ends = [complex(end.x, end.y) for end in (line.dxf.start, line.dxf.end)]
    export_design(slider_crank, tmp_path / "a.svg")
    (drawn,) = ElementTree.parse(tmp_path / "a.svg").iterfind(".//{*}g[@id='ground']/{*}polyline")
    in_svg = [complex(*map(float, corner.split(","))) for corner in drawn.get("points").split()]
    data = player_data(slider_crank)
    x1, y1, x2, y2 = (path[0] for path in data["guides"][0])
    for z in pins:
        assert on_segment(z, *ends) and on_segment(z, *in_svg) and on_segment(z, complex(x1, y1), complex(x2, y2))
    export_design(slider_crank, tmp_path / "a.csv")
    (row,) = (row for row in csv.DictReader((tmp_path / "a.csv").open()) if row["kind"] == "slide")
    direction = np.exp(1j * np.radians(float(row["value"])))
    off = (np.array(pins) - complex(float(row["x"]), float(row["y"]))) * np.conj(direction)
    assert row["name"] == "ground" and np.abs(off.imag).max() < 1e-9


def test_slots_turn_with_their_disk_and_hold_their_pins():
    """In every frame of a Wanzer linkage each pin is on its slot, which keeps its place in the disk."""
    design = synthesize(Task.from_file("examples/wanzer_three_poses.toml")).accepted[0]
    linkage = design.linkage
    motion = travel(design)
    found = design_rails(design, 0.1, motion)
    assert len(found) == len(linkage.slots) + len(linkage.sliders) >= 3
    guides = [s.at for s in linkage.sliders] + [slot.point for slot in linkage.slots]
    for rail, pin in zip(found, guides):
        first, last = (np.broadcast_to(z, len(motion)) for z in rail.ends(linkage, motion.points, motion.rotations))
        for z, a, b in zip(motion.points[pin], first, last):
            assert on_segment(z, a, b)
        if rail.link != "ground":
            (pivot,) = linkage.links[rail.link]
            np.testing.assert_allclose(np.abs(first - motion.points[pivot]), abs(rail.first - linkage.points[pivot]))


def test_a_long_caption_stays_on_a_narrow_page(design):
    tall = Linkage({"O": 0, "A": 30j}, {"ground": ["O"], "a": ["O", "A"]}, bodies={"P": ("a", "A")}, title="A " * 30)
    ax = draw_design(replace(design, linkage=tall, poses=({"a": 0.0}, {"a": 0.05}), input=""))
    figure = ax.figure
    figure.canvas.draw()
    title = ax.title if ax.title.get_text() else ax._left_title
    box = title.get_window_extent()
    assert title.get_text().count("\n") >= 2 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1


def test_numbers_of_many_poses_do_not_run_into_one_another():
    links = {"ground": ["O"], "a": ["O", "A"]}
    linkage = Linkage({"O": 0, "A": 1}, links, bodies={"P": ("a", "A")})
    ax = draw_design(Design("D001", 0, linkage=linkage, poses=tuple({"a": 0.02 * k} for k in range(40))))
    places = {t.get_text(): complex(*t.get_position()) for t in ax.texts if re.fullmatch(r"P\d+", t.get_text())}
    assert {"P0", "P39"} <= set(places) and 5 < len(places) < 35
    size = max(np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim()))
    spots = list(places.values())
    assert min(abs(a - b) for n, a in enumerate(spots) for b in spots[:n]) > 0.03 * size


def test_json_export_is_the_whole_design(design, result, tmp_path):
    export_design(design, tmp_path / "a.json", result.task)
    document = json.loads((tmp_path / "a.json").read_text())
    assert document["links"] == design.links and document["task"] == result.task.to_dict()
    assert document["units"]["length"] == design.linkage.length_unit and document["units"]["angle"].startswith("rad")


def test_without_ezdxf_it_is_named(design, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ezdxf", None)
    with pytest.raises(TaskError, match="pip install ezdxf"):
        export_design(design, tmp_path / "a.dxf")


def test_formula_injection_is_quoted(design, tmp_path):
    linkage = replace(design.linkage, length_unit="=1+1")
    export_design(replace(design, linkage=linkage), tmp_path / "a.csv")
    assert "'=1+1" in (tmp_path / "a.csv").read_text()


@pytest.mark.parametrize(
    "label", ["$x", "$\\frac{1}$", "[bold]x[/bold] [/]", "[link=file:///etc/passwd]a[/link]", "µm \u202e %s {0}"]
)
def test_labels_are_text_and_nothing_else(result, tmp_path, label):
    """Neither Matplotlib's formulas nor Rich's markup nor HTML is read out of a task's labels."""
    from rich.console import Console

    from mechanisms.tables import design_sheet, headline, result_table

    task = replace(result.task, title=label, length_unit=label)
    design = result.accepted[0]
    design = replace(design, linkage=replace(design.linkage, title=label, length_unit=label), note=label)
    labelled = replace(result, task=task, designs=[design])
    for kind in ("svg", "gif", "html"):
        save_design(design, tmp_path / f"a.{kind}", task)
    for kind in ("dxf", "svg", "csv"):
        export_design(design, tmp_path / f"e.{kind}")
    ElementTree.parse(tmp_path / "e.svg")
    console = Console(width=200, record=True, file=(tmp_path / "out.txt").open("w"))
    console.print(result_table([design], label))
    console.print(design_sheet(design, labelled))
    assert console.export_text().count(label) >= 2
    assert headline(labelled)[0] == label
    report_page(labelled)
