# SPDX-License-Identifier: Apache-2.0
"""Uses a page of `peeler view` in headless Chromium as a visitor would.

    view_page_test.py PAGE.html OUT_FOLDER [screenshots]

Writes what the canvas shows after each step as PNG (original, one_layer, depth, dragged, keys,
nearer, reset), and console.json: what the browser's console said. With "screenshots" also pictures
of all of the page, for eyes (on a busy machine Chromium may not be in time for them).
Exit code 77: there is no Chromium, no chromedriver or no Selenium; why is on stdout.
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
        self.driver, self.out, self.wait = driver, out, WebDriverWait(driver, ENDLESS)

    def frames(self):
        return int(self.driver.execute_script(
            "return document.getElementById('picture').dataset.frame || 0"))

    def after(self, action):
        """Does something and waits until the page has drawn it."""
        before = self.frames()
        action()
        self.wait.until(lambda _: self.frames() > before)
        # What else was asked for meanwhile is drawn by the frame after next.
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))")

    def run(self, script, *arguments):
        self.after(lambda: self.driver.execute_script(script, *arguments))

    def save(self, name):
        url = self.driver.execute_script(
            "return document.getElementById('picture').toDataURL('image/png')")
        (self.out / f"{name}.png").write_bytes(base64.b64decode(url.split(",", 1)[1]))


def main():
    page_file, out = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    screenshots = sys.argv[3:] == ["screenshots"]
    try:
        driver = start()
    except Missing as what:
        print(what)
        sys.exit(SKIP)
    try:
        from selenium.webdriver.common.action_chains import ActionChains
        from selenium.webdriver.common.keys import Keys
        page = Page(driver, out)
        driver.get(page_file.as_uri())
        page.wait.until(lambda _: page.frames() > 0)
        if screenshots:
            driver.save_screenshot(str(out / "page.png"))

        # A pixel of the canvas for a pixel of the capture.
        page.run("const c = document.getElementById('picture');"
                 "c.style.border = 0;"
                 "c.style.width = JSON.parse(document.getElementById('view').textContent).width + 'px'")
        page.save("original")
        slide = ("const s = document.getElementById('layers'); s.value = arguments[0];"
                 "s.dispatchEvent(new Event('input'))")
        page.run(slide, 1)
        page.save("one_layer")
        page.run(slide, 10000)
        page.after(lambda: driver.find_element("id", "depth").click())
        page.save("depth")
        page.after(lambda: driver.find_element("id", "depth").click())
        canvas = driver.find_element("id", "picture")
        page.after(lambda: ActionChains(driver).click_and_hold(canvas)
                   .move_by_offset(-40, 10).release().perform())
        page.save("dragged")
        if screenshots:
            driver.save_screenshot(str(out / "page_dragged.png"))
        page.after(lambda: driver.find_element("tag name", "body").send_keys(
            Keys.ARROW_LEFT, Keys.ARROW_LEFT, "["))
        page.save("keys")
        page.run("document.getElementById('picture').dispatchEvent("
                 "new WheelEvent('wheel', {deltaY: -200, cancelable: true}))")
        page.save("nearer")
        page.after(lambda: driver.find_element("id", "reset").click())
        page.save("reset")
        (out / "console.json").write_text(json.dumps(driver.get_log("browser"), indent=1))
    finally:
        driver.quit()


main()
