# SPDX-License-Identifier: Apache-2.0
"""Headless Chromium without a GPU, driven through Debian's chromedriver and Selenium."""
import shutil

ENDLESS = 300  # timeout in seconds; a frame takes a fraction of a second
FLAGS = [
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--force-device-scale-factor=1",
    "--window-size=600,500", "--disable-background-networking",
]


class Missing(Exception):
    """Names a program or module that is missing."""


def start():
    """Returns the driver of a new browser; its `quit()` ends the browser."""
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        raise Missing("no Selenium: apt-get install python3-selenium") from None
    browser, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not browser or not driver:
        raise Missing("no Chromium with chromedriver: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(service=Service(driver), options=options)
    driver.set_script_timeout(ENDLESS)  # the default is 30 seconds
    return driver
