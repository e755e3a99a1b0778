"""restage.no_grad."""
import contextlib

from . import _core


class no_grad(contextlib.ContextDecorator):
    """with restage.no_grad(): ops on leaves are computed, and not recorded; also as a decorator, @restage.no_grad().

    It holds for the thread that entered it. What comes out is a constant, as that of detach().
    """

    def _recreate_cm(self):
        return no_grad()

    def __enter__(self):
        self._before = _core.set_recording(False)

    def __exit__(self, *error):
        _core.set_recording(self._before)
