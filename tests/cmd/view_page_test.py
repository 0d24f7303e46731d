# SPDX-License-Identifier: Apache-2.0
"""Operates a page of `peeler view` in headless Chromium as a visitor does.

    view_page_test.py PAGE.html OUT_FOLDER TOUR [X,Y...]

Writes the canvas after each step of a tour as PNG, the browser's console as console.json, and the page's readings as
readings.json, with those of the pixels X, Y under "X,Y". The tours are:

- "look", around the scene: original, one_layer, depth, alpha, dragged, keys, nearer, reset;
- "filter", a short one: original, depth, alpha, keys, reset;
- "read", for a scene of three layers: original, only_2, layer_2, alpha_1, each channel, moved, moved_by_fingers,
  moved_by_keys, reset;
- "picture" writes only page.png: the whole window, with the pointer on the first of the given canvas pixels.

Exit code 77: Chromium, chromedriver or Selenium is missing; the reason is on stdout.
"""
import base64
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from chromium import ENDLESS, Missing, start  # noqa: E402

SKIP = 77


class Page:
    def __init__(self, driver, out):
        from selenium.webdriver.support.ui import WebDriverWait
        self.driver, self.out = driver, out
        self.wait = WebDriverWait(driver, ENDLESS, poll_frequency=0.02)  # the default would poll only twice per second
        self.readings = {}

    def count(self, what):
        """Returns the number of frames, of the canvas or of the readings below it."""
        return int(self.driver.execute_script(
            {"frame": "return document.getElementById('picture').dataset.frame || 0",
             "reading": "return document.getElementById('probe').dataset.reading || 0"}[what]))

    def after(self, action, what="frame"):
        """Performs an action and waits until the page has drawn it."""
        before = self.count(what)
        action()
        self.wait.until(lambda _: self.count(what) > before)
        # Pending changes may appear one frame later, so wait for two frames.
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))")

    def run(self, script, *arguments):
        self.after(lambda: self.driver.execute_script(script, *arguments))

    def element(self, name):
        return self.driver.find_element("id", name)

    def click(self, name):
        self.after(lambda: self.element(name).click())

    def press(self, *keys):
        self.after(lambda: self.driver.find_element("tag name", "body").send_keys(*keys))

    def slide(self, layer):
        self.run("const s = document.getElementById('layers'); s.value = arguments[0];"
                 "s.dispatchEvent(new Event('input'))", layer)

    def show(self, channel):
        self.run("const s = document.getElementById('channel'); s.value = arguments[0];"
                 "s.dispatchEvent(new Event('input'))", channel)

    def drag(self, x, y):
        from selenium.webdriver.common.action_chains import ActionChains
        return (ActionChains(self.driver, duration=50).click_and_hold(self.element("picture"))
                .move_by_offset(x, y).release())

    def save(self, name):
        url = self.driver.execute_script(
            "return document.getElementById('picture').toDataURL('image/png')")
        (self.out / f"{name}.png").write_bytes(base64.b64decode(url.split(",", 1)[1]))

    def told(self, name, element="probe"):
        self.readings[name] = self.driver.execute_script(
            "return document.getElementById(arguments[0]).textContent.trim()", element)

    def point(self, x, y, name=None, kind="mouse"):
        """Points at a pixel of the canvas with a mouse or a finger."""
        self.after(lambda: self.driver.execute_script(
            "const c = document.getElementById('picture'), r = c.getBoundingClientRect();"
            "c.dispatchEvent(new PointerEvent('pointermove', {pointerType: arguments[2],"
            "  clientX: r.left + arguments[0] + 0.5, clientY: r.top + arguments[1] + 0.5}))",
            x, y, kind), "reading")
        self.told(name or f"{x},{y}")


def one_to_one(page, pixels):
    """Resizes the canvas so that one canvas pixel shows one pixel of the capture."""
    page.run("const c = document.getElementById('picture');"
             "c.style.border = 0;"
             "c.style.width = JSON.parse(document.getElementById('view').textContent).width + 'px'")
    page.save("original")
    for x, y in pixels:
        page.point(x, y)


def picture(page, pixels):
    page.point(*pixels[0], kind="touch")
    page.driver.save_screenshot(str(page.out / "page.png"))


def filter_(page, pixels):
    one_to_one(page, pixels)
    page.press("d")
    page.save("depth")
    page.show("alpha")
    page.save("alpha")
    page.show("color")
    from selenium.webdriver.common.keys import Keys
    page.press(Keys.ARROW_LEFT)
    page.save("keys")
    page.click("reset")
    page.save("reset")


def look(page, pixels):
    one_to_one(page, pixels)
    page.slide(1)
    page.save("one_layer")
    page.slide(10000)
    page.press("d")
    page.save("depth")
    page.show("alpha")
    page.save("alpha")
    page.show("color")
    page.after(lambda: page.drag(-40, 10).perform())
    page.save("dragged")
    from selenium.webdriver.common.keys import Keys
    page.press(Keys.ARROW_LEFT, Keys.ARROW_LEFT, "[")
    page.save("keys")
    page.run("document.getElementById('picture').dispatchEvent("
             "new WheelEvent('wheel', {deltaY: -200, cancelable: true}))")
    page.save("nearer")
    page.click("reset")
    page.save("reset")


def two_fingers(driver, canvas, right, down):
    """Moves two fingers, one above the other, step by step in parallel."""
    from selenium.webdriver.common.actions.action_builder import ActionBuilder
    actions, steps = ActionBuilder(driver), 10
    for name, y in (("one", -15), ("other", 15)):
        finger = actions.add_pointer_input("touch", name)
        finger.create_pointer_move(duration=0, x=0, y=y, origin=canvas)
        finger.create_pointer_down(button=0)
        for _ in range(steps):
            finger.create_pointer_move(duration=0, x=right // steps, y=down // steps,
                                       origin="pointer")
        finger.create_pointer_up(button=0)
    actions.perform()


def read(page, pixels):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys
    one_to_one(page, pixels)
    driver, canvas = page.driver, page.element("picture")
    page.readings["layout"] = driver.execute_script(
        "return ['title', 'help', 'picture', 'probe', 'controls'].map("
        "id => document.getElementById(id).getBoundingClientRect().top)")
    page.readings["menu_opens"] = driver.execute_script(
        "return document.getElementById('picture').dispatchEvent("
        "new MouseEvent('contextmenu', {cancelable: true}))")

    page.told("of all", "shown")
    page.slide(2)
    page.told("two", "shown")
    page.press("o")
    page.told("second", "shown")
    page.save("only_2")
    page.point(48, 32, "only 1")
    page.show("layer")
    page.told("ramp from", "low")
    page.told("ramp to", "high")
    page.save("layer_2")
    page.slide(1)
    page.show("alpha")
    page.save("alpha_1")
    page.click("only")
    page.slide(3)
    for channel in ("depth", "layer", "object", "normal"):
        page.show(channel)
        page.save(channel)
    page.show("color")
    cycle = []
    for _ in range(6):
        page.press("c")
        cycle.append(page.element("channel").get_attribute("value"))
    page.readings["cycle"] = cycle

    # Moves the camera.
    def shift_drag():
        ActionChains(driver).key_down(Keys.SHIFT).perform()
        page.drag(20, -10).perform()
        ActionChains(driver).key_up(Keys.SHIFT).perform()
    page.after(shift_drag)
    page.save("moved")
    page.point(30, 40, "moved")
    page.click("reset")
    page.save("reset")
    page.after(lambda: two_fingers(driver, canvas, 20, -10))
    page.point(30, 40, "moved by fingers")
    page.save("moved_by_fingers")
    page.press("r")
    page.press(Keys.SHIFT, Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    page.save("moved_by_keys")
    page.press("r")
    page.after(lambda: driver.find_element("tag name", "body").send_keys("p"), "reading")
    page.told("middle")
    page.after(lambda: driver.execute_script(
        "document.getElementById('picture').dispatchEvent("
        "new PointerEvent('pointerleave', {pointerType: 'mouse'}))"), "reading")
    page.told("nowhere")


def main():
    page_file, out = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    tour = {"look": look, "filter": filter_, "read": read, "picture": picture}[sys.argv[3]]
    pixels = [[int(x) for x in pair.split(",")] for pair in sys.argv[4:]]
    try:
        driver = start()
    except Missing as what:
        print(what)
        sys.exit(SKIP)
    try:
        page = Page(driver, out)
        driver.get(page_file.as_uri())
        page.wait.until(lambda _: page.count("frame") > 0)
        tour(page, pixels)
        (out / "readings.json").write_text(json.dumps(page.readings, indent=1))
        (out / "console.json").write_text(json.dumps(driver.get_log("browser"), indent=1))
    finally:
        driver.quit()


main()
