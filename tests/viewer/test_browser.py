"""The page that plays runs, in a real browser: what people see and do."""

import io
import threading

import numpy as np
import pytest
from browsers import NARROW, WIDE, Trouble, browser
from PIL import Image
from run_folders import run_underway

from mpisph.figures.fields import choose_fields
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import read_run
from mpisph.report.run_page import write_report
from mpisph.viewer.packing import LEVELS
from mpisph.viewer.page import make_view, page, shown_run, write_view
from mpisph.viewer.serve import make_server

pytestmark = pytest.mark.slow

READY = ".viewer[data-ready]"
SPHERE, PLATE = (0x00, 0x72, 0xB2), (0xE6, 0x9F, 0x00)


@pytest.fixture(scope="module")
def chrome():
    with browser() as started:
        yield started


@pytest.fixture(scope="module")
def shot(finished, tmp_path_factory):
    out = tmp_path_factory.mktemp("shot") / "view.html"
    write_view([finished], out)
    return out


@pytest.fixture(scope="module")
def opened(chrome):
    """Open a page, and see at the end that none had trouble."""
    contexts, troubles = [], []

    def open_page(place, size=WIDE, ready=READY, bypass_csp=True, **more):
        # What a test evaluates is no part of the page, whose policy forbids it.
        context = chrome.new_context(viewport=size, bypass_csp=bypass_csp, **more)
        contexts.append(context)
        tab = context.new_page()
        troubles.append(Trouble(tab))
        tab.goto(place if isinstance(place, str) else place.as_uri())
        tab.wait_for_selector(ready, state="attached", timeout=30_000)
        settle(tab)
        return tab

    yield open_page
    for context in contexts:
        context.close()
    assert troubles == [[]] * len(troubles)


@pytest.fixture(scope="module")
def shared(opened, shot):
    """The page of a run, for several tests."""
    return opened(shot)


@pytest.fixture
def tab(shared):
    """That page as it was at first."""
    ask(shared, "v.choose('body', 'body')")
    ask(shared, "v.show(v.times.length - 1)")
    ask(shared, "v.fit()")
    shared.mouse.move(0, 0)
    settle(shared)
    return shared


def settle(tab):
    """Wait until what was asked for is drawn."""
    tab.wait_for_timeout(150)


def ask(tab, code):
    viewer = "document.querySelector('.viewer').viewer"
    return tab.evaluate(f"() => {{ const v = {viewer}; return {code}; }}")


def picture(tab, index=0):
    """The pixels of a stage."""
    data = tab.locator(".viewer-stage").nth(index).screenshot()
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def has_colour(pixels, colour):
    return int((np.abs(pixels - np.array(colour)).max(axis=2) < 12).sum())


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["wide", "narrow"])
def test_it_opens_in_any_size_and_light(opened, shot, size):
    scheme = "light" if size is WIDE else "dark"
    tab = opened(shot, size, bypass_csp=False, color_scheme=scheme)
    assert has_colour(picture(tab), SPHERE) > 100
    assert has_colour(picture(tab), PLATE) > 100
    width = tab.locator("body").bounding_box()["width"]
    assert width <= size["width"]
    for part in tab.locator(".viewer button, .viewer select, .viewer input").all():
        box = part.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= size["width"]


def test_the_slider_moves_the_run(tab, finished):
    times = [1e6 * time for _, time in read_run(finished).snapshots]
    last = picture(tab)
    slider = tab.get_by_label("time", exact=True)
    assert slider.input_value() == str(len(times) - 1)
    slider.press("Home")
    settle(tab)
    assert tab.locator("output").inner_text() == "0 µs"
    first = picture(tab)
    assert np.abs(first - last).max(axis=2).astype(bool).mean() > 0.01
    slider.press("ArrowRight")
    settle(tab)
    shown = tab.locator("h2 span").inner_text()
    assert shown == f"t = {times[1]:.4g} µs after first contact"


def test_play_goes_to_the_end_and_stops(tab):
    tab.get_by_label("frames/s").select_option("30")
    tab.get_by_role("button", name="Play").click()
    tab.wait_for_function(
        "() => { const v = document.querySelector('.viewer').viewer;"
        " return !v.timer && v.position === v.times.length - 1; }"
    )
    assert tab.get_by_role("button", name="Play").is_visible()


PLACE = """([id, panel]) => {
    const item = document.querySelector('.viewer').viewer.items[panel];
    const { run, frame, stage, view } = item;
    const [z, r] = [0, 1].map((k) => run.value(frame, k, run.ids.indexOf(id)));
    const box = stage.getBoundingClientRect(), scale = 2 ** view.zoom;
    const x = box.x + stage.clientLeft + stage.clientWidth / 2;
    const y = box.y + stage.clientTop + stage.clientHeight / 2;
    return [x + (z - view.target[0]) * scale, y - (r - view.target[1]) * scale];
}"""


def place_of(tab, particle, panel=0):
    """Where on the screen a particle is, by its id."""
    return tab.evaluate(PLACE, [particle, panel])


def tip_of(tab):
    """The values under the pointer."""
    tab.wait_for_selector(".viewer-tip:not([hidden])", timeout=20_000)
    heads = tab.locator(".viewer-tip th").all_inner_texts()
    values = tab.locator(".viewer-tip td").all_inner_texts()
    caption = tab.locator(".viewer-tip caption").inner_text()
    return caption, dict(zip(heads, values, strict=True))


def test_the_pointer_shows_the_stored_values(tab, finished):
    run = read_run(finished)
    arrays = read_snapshot(run.snapshots[-1][0]).arrays
    # One that lies alone, so that no other is drawn over it.
    z, r = 1e3 * arrays["z"], 1e3 * arrays["r"]
    view = ask(tab, "v.union")
    inside = (z > view["z_low"] + 2) & (z < view["z_high"] - 2)
    inside &= (r < view["r_high"] - 2) & (r > 1.0)
    apart = [np.sort(np.hypot(z - z[k], r - r[k]))[1] for k in range(len(z))]
    k = int(np.argmax(np.where(inside, apart, 0.0)))
    tab.mouse.move(*place_of(tab, int(arrays["id"][k])))
    caption, values = tip_of(tab)
    body = run.case.bodies[arrays["body"][k]].name
    assert caption == f"particle {arrays['id'][k]} of {body}"
    scale = {"z": (z, "mm"), "r": (r, "mm"), "density": (1e-3 * arrays["rho"], "g/cm³")}
    scale["smoothing length"] = (1e3 * arrays["h"], "mm")
    scale["pressure"] = (1e-9 * arrays["P"], "GPa")
    for name, (known, unit) in scale.items():
        number, _, text = values[name].replace("−", "-").partition(" ")
        assert text == unit
        step = np.ptp(known) / LEVELS
        assert float(number) == pytest.approx(known[k], rel=1e-3, abs=step)


def test_a_tap_shows_them_too_and_nothing_scrolls_sideways(opened, shot):
    tab = opened(shot, NARROW, has_touch=True)
    assert tab.evaluate("() => document.documentElement.scrollWidth") <= 420
    tab.touchscreen.tap(*place_of(tab, 0))
    assert "of sphere" in tip_of(tab)[0]


def test_bodies_are_switched_off_and_on(tab):
    box = tab.get_by_label("plate", exact=True)
    box.uncheck()
    settle(tab)
    assert has_colour(picture(tab), PLATE) == 0
    assert has_colour(picture(tab), SPHERE) > 100
    box.check()
    settle(tab)
    assert has_colour(picture(tab), PLATE) > 100


def test_halves_show_fields_of_their_own(tab):
    tab.get_by_label("below the axis").select_option("density")
    settle(tab)
    pixels = picture(tab)
    middle = len(pixels) // 2
    assert has_colour(pixels[: middle - 5], SPHERE) > 50
    assert has_colour(pixels[middle + 5 :], SPHERE) == 0
    assert tab.locator(".viewer-label").all_inner_texts() == ["below: density [g/cm³]"]


def test_colours_follow_the_limits_typed_in(tab):
    tab.get_by_label("colours", exact=True).select_option("speed")
    settle(tab)
    before = picture(tab)
    high = tab.get_by_label("highest speed [km/s] of the colours")
    known = high.input_value()
    high.fill("0.001")
    high.press("Enter")
    settle(tab)
    assert np.abs(picture(tab) - before).max(axis=2).astype(bool).mean() > 0.005
    high.fill("-5")  # below the lowest: the run's own limits come back
    high.press("Enter")
    settle(tab)
    assert high.input_value() == known
    assert np.array_equal(picture(tab), before)


def test_drag_wheel_and_keys_move_the_view(tab):
    stage = tab.locator(".viewer-stage").bounding_box()
    x, y = stage["x"] + stage["width"] / 2, stage["y"] + stage["height"] / 2
    start = ask(tab, "v.items[0].view")
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 60, y, steps=4)
    tab.mouse.up()
    settle(tab)
    moved = ask(tab, "v.items[0].view")
    way = 60 / 2 ** start["zoom"]
    # A drag begins some pixels after the press.
    assert moved["target"][0] == pytest.approx(start["target"][0] - way, abs=0.3 * way)
    tab.mouse.wheel(0, -300)
    settle(tab)
    assert ask(tab, "v.items[0].view")["zoom"] > moved["zoom"]
    tab.keyboard.press("0")
    settle(tab)
    back = ask(tab, "v.items[0].view")
    assert back["zoom"] == pytest.approx(start["zoom"])
    assert back["target"] == pytest.approx(start["target"])
    tab.keyboard.press("+")
    assert ask(tab, "v.items[0].view")["zoom"] > back["zoom"]
    tab.keyboard.press("f")
    assert ask(tab, "v.above") != "body"


def test_a_body_fills_the_view(tab, finished):
    start = ask(tab, "v.items[0].view.zoom")
    tab.get_by_label("view", exact=True).select_option("body sphere")
    settle(tab)
    assert ask(tab, "v.items[0].view.zoom") > start + 0.3
    run = read_run(finished)
    arrays = read_snapshot(run.snapshots[-1][0]).arrays
    mine = arrays["id"][arrays["body"] == 0]
    stage = tab.locator(".viewer-stage").bounding_box()
    inside = 0
    for particle in mine:
        x, y = place_of(tab, int(particle))
        inside += (
            0 < x - stage["x"] < stage["width"] and 0 < y - stage["y"] < stage["height"]
        )
    assert inside > 0.9 * len(mine)


def test_runs_side_by_side_stay_in_step(opened, finished, judged, tmp_path):
    out = tmp_path / "two.html"
    write_view([finished, judged], out)
    tab = opened(out)
    assert tab.locator(".viewer-stage").count() == 2
    runs = [read_run(folder) for folder in (finished, judged)]
    ends = [1e6 * run.snapshots[-1][1] for run in runs]
    times = ask(tab, "v.times")
    assert times == sorted({*times})
    for position in (0, len(times) // 2, len(times) - 1):
        tab.evaluate(f"() => document.querySelector('.viewer').viewer.show({position})")
        now = times[position]
        for index, run in enumerate(runs):
            passed = [1e6 * t for _, t in run.snapshots if 1e6 * t <= now * (1 + 1e-9)]
            frame = ask(tab, f"v.items[{index}].frame")
            assert frame == max(len(passed) - 1, 0)
    assert max(ends) == pytest.approx(times[-1])
    tab.get_by_label("colours", exact=True).select_option("damage")
    heads = tab.locator("h2 span").all_inner_texts()
    assert ["no damage" in head for head in heads] == [True, False]
    tab.locator(".viewer-stage").first.click()
    tab.keyboard.press("+")
    zooms = ask(tab, "v.items.map((item) => item.view.zoom)")
    assert zooms[0] == pytest.approx(zooms[1])


def test_hostile_names_stay_text(opened, finished, tmp_path):
    nasty = "<img src=x onerror=alert(1)></script><script>alert(2)</script>"
    run = read_run(finished)
    run = run._replace(name=nasty, case=run.case.model_copy(update={"title": nasty}))
    shown = shown_run(run)
    shown.description["bodies"][0]["name"] = nasty
    shown.description["note"] = nasty
    out = tmp_path / "nasty.html"
    twice = [run, run]
    out.write_text(page(twice, make_view(twice, [shown, shown])))
    tab = opened(out)
    said = []
    tab.on("dialog", lambda dialog: (said.append(dialog.message), dialog.dismiss()))
    assert tab.locator(".viewer-name").first.inner_text() == nasty
    tab.mouse.move(*place_of(tab, 0))
    assert nasty in tip_of(tab)[0]
    assert tab.locator("img[src=x]").count() == 0
    assert said == []


def test_a_report_plays_its_run(opened, judged, tmp_path):
    tab = opened(write_report([judged], tmp_path / "report.html"))
    assert ask(tab, "[v.above, v.below]") == ["damage", "speed"]
    assert len(np.unique(picture(tab).reshape(-1, 3), axis=0)) > 10
    # The wheel turns the page until the picture was clicked.
    stage = tab.locator(".viewer-stage")
    stage.scroll_into_view_if_needed()
    stage.hover()
    before = ask(tab, "v.items[0].view.zoom")
    tab.mouse.wheel(0, 200)
    settle(tab)
    assert ask(tab, "v.items[0].view.zoom") == before
    stage.click()
    settle(tab)
    tab.mouse.wheel(0, -200)
    settle(tab)
    assert ask(tab, "v.items[0].view.zoom") > before


def test_a_page_that_is_served_follows_the_run(opened, finished, tmp_path):
    folder, go_on = run_underway(finished, tmp_path / "run")
    count = len(read_run(finished).snapshots)
    with make_server([folder], chosen=choose_fields(["speed"], [])) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        tab = opened(f"http://127.0.0.1:{server.server_address[1]}/")
        assert ask(tab, "v.times.length") == count - 2
        go_on()
        tab.wait_for_function(
            f"() => document.querySelector('.viewer').viewer.times.length === {count}",
            timeout=30_000,
        )
        assert ask(tab, "v.position") == count - 1, "who looked at the end still does"
        server.shutdown()


NO_WEBGL = """
    const known = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return kind === "webgl2" ? null : known.call(this, kind, ...more);
    };
"""


def test_without_webgl_there_are_pictures(chrome, shot):
    tab = chrome.new_page()
    trouble = Trouble(tab)
    tab.add_init_script(NO_WEBGL)
    tab.goto(shot.as_uri())
    tab.wait_for_selector(".viewer-pictures:not([hidden])")
    assert "cannot play the run" in tab.locator(".viewer-note").first.inner_text()
    widths = tab.locator("img").evaluate_all("all => all.map(i => i.naturalWidth)")
    assert len(widths) == 2
    assert min(widths) > 500
    assert trouble == []
    tab.close()
