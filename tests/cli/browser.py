"""A headless Chromium whose page a test may look at while it plays. The browser is spoken to through two pipes, as
--remote-debugging-pipe has it: messages of JSON, each ended by a zero byte."""
import base64
import json
import os
import select
import subprocess
import time

PROGRAM = next((path for path in (os.environ.get("CHROMIUM"), "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome")
                if path and os.path.exists(path)), None)


class Browser:
    def __init__(self, test, address):
        """Opens `address`; the browser ends with `test`."""
        theirs_in, self.ours_out = os.pipe()
        self.ours_in, theirs_out = os.pipe()
        self.rest, self.number = b"", 0

        def pipes():  # the browser reads descriptor 3 and writes descriptor 4
            high_in, high_out = os.dup2(theirs_in, 103), os.dup2(theirs_out, 104)
            os.dup2(high_in, 3)
            os.dup2(high_out, 4)
        process = subprocess.Popen([PROGRAM, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--use-angle=swiftshader",
                                    "--enable-unsafe-swiftshader", "--user-data-dir=" + test.path("profile"), "--remote-debugging-pipe", address],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=pipes, close_fds=False)
        for descriptor in (theirs_in, theirs_out):
            os.close(descriptor)
        for clean in (lambda: os.close(self.ours_in), lambda: os.close(self.ours_out), process.wait, process.kill):
            test.addCleanup(clean)
        page = self._page_of(address)
        self.session = self._ask("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]

    def page(self):
        """The page as it is now, in HTML; empty while it loads."""
        expression = "document.documentElement ? document.documentElement.outerHTML : ''"
        return self._ask("Runtime.evaluate", self.session, expression=expression)["result"]["value"]

    def picture(self):
        """The page as it is seen, PNG."""
        return base64.b64decode(self._ask("Page.captureScreenshot", self.session, format="png")["data"])

    def _page_of(self, address):
        until = time.monotonic() + 60
        while time.monotonic() < until:
            for target in self._ask("Target.getTargets")["targetInfos"]:
                if target["type"] == "page" and target["url"] == address:
                    return target["targetId"]
            time.sleep(0.1)
        raise AssertionError("the browser did not open the page in a minute")

    def _ask(self, method, session=None, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self.ours_out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message()
            if answer.get("id") == self.number:
                assert "result" in answer, answer
                return answer["result"]

    def _message(self):
        while b"\0" not in self.rest:
            if not select.select([self.ours_in], [], [], 60)[0]:
                raise AssertionError("the browser was silent for a minute")
            piece = os.read(self.ours_in, 1 << 20)
            if not piece:
                raise AssertionError("the browser ended")
            self.rest += piece
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)
