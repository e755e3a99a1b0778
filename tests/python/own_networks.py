"""Networks that test_network.py trains; its programs import them by their file."""
import numpy as np
import restage
from restage import layers, ops


@restage.model("tiny/points", role="skeleton")
class Points:
    """A small extractor: each point, the largest over all points, the joints."""
    points = 96

    def __init__(self, width: int = 16):
        self.each = [layers.Linear(3, width), layers.Linear(width, width)]
        self.head = {"joints": layers.Linear(width, 66)}

    def forward(self, ctx, x):
        h = x.cloud
        for layer in self.each:
            h = layer(ctx, h, "relu")
        return self.head["joints"](ctx, h.max(1)).reshape(-1, 22, 3)


@restage.model("tiny/turns", role="motion")
class Turns:
    """A small motion network with a state."""

    def __init__(self, hidden: int = 12, dropout: float = 0.0):
        self.gru = layers.GRU(66 + 3 + 66, hidden)
        self.turn = layers.Linear(hidden, 132, small=True)
        self.path = layers.Linear(hidden, 3)
        self.rest_pose = restage.Tensor(np.tile(np.float32([1, 0, 0, 0, 1, 0]), 22))
        self._dropout = dropout

    def forward(self, ctx, x):
        n, t = x.joints.shape[:2]
        rest = ops.expand(x.rest.reshape(n, 1, 66), (n, t, 66))
        seen = ops.concat([x.joints.reshape(n, t, 66), x.trans, rest], 2)
        h, state = self.gru(ctx, seen, x.state[0] if x.state else None)
        h = ctx.dropout(h, self._dropout)
        return {"sixd": (self.turn(ctx, h) + self.rest_pose).reshape(n, t, 22, 6), "trans": self.path(ctx, h) + x.trans,
                "state": [state]}


@restage.model("tiny/judged", role="motion")
class Judged(Turns):
    """The same with a loss and a figure of its own."""
    figures = ("calls",)

    def __init__(self, hidden: int = 12, dropout: float = 0.0):
        super().__init__(hidden, dropout)
        self.calls = 0

    def loss(self, ctx, x, batch):
        self.calls += 1
        assert batch["joints_a"].shape == x.joints.shape and "truth_b" not in batch
        answer = self.forward(ctx, x)
        return ops.mse(answer["sixd"].reshape(*batch["sixd_a"].shape), batch["sixd_a"])

    def validate(self, measured):
        assert "pa_mpjpe" in measured
        return {"calls": self.calls}


@restage.model("tiny/smrm", role="motion")
class Smrm:
    """smrm/rot6d, line by line."""

    def __init__(self, hidden: int = 16, dropout: float = 0.1):
        self.enc = layers.GRU(69, hidden, 2, dropout)
        self.dec = layers.GRU(hidden + 66, hidden, 2, dropout)
        self.fc_rot = layers.Linear(hidden, 132, small=True)
        self.fc_trans = layers.Linear(hidden, 3)
        for name, width in (("joint", 66), ("rest", 66), ("trans", 3), ("rot", 132)):
            setattr(self, f"{name}_mean", restage.Tensor.zeros(width))
            setattr(self, f"{name}_std", restage.Tensor(np.ones(width, np.float32)))

    def standardise(self, statistics):
        for name, of in (("joint", "joints"), ("rest", "rest"), ("trans", "trans"), ("rot", "sixd")):
            mean, deviation = statistics[of]
            getattr(self, f"{name}_mean").assign(mean)
            getattr(self, f"{name}_std").assign(deviation)

    def forward(self, ctx, x):
        n, t = x.joints.shape[:2]
        a = (x.joints.reshape(n, t, 66) - self.joint_mean) / self.joint_std
        v = (x.trans - self.trans_mean) / self.trans_std
        b = (x.rest.reshape(n, 1, 66) - self.rest_mean) / self.rest_std
        state = x.state or [None, None]
        code, first = self.enc(ctx, ops.concat([a, v], 2), state[0])
        decoded, second = self.dec(ctx, ops.concat([code, ops.expand(b, (n, t, 66))], 2), state[1])
        sixd = self.fc_rot(ctx, decoded) * self.rot_std + self.rot_mean
        trans = self.fc_trans(ctx, decoded) * self.trans_std + self.trans_mean
        return {"sixd": sixd.reshape(n, t, 22, 6), "trans": trans, "state": [first, second]}


@restage.model("tiny/field", role="deformation.weights")
class Field:
    """Skinning weights by the distances to the joints."""

    def __init__(self, sharp: float = 20.0):
        self.sharp = restage.Parameter(np.full((1, 1, 22), sharp))

    def forward(self, ctx, x):
        apart = x.points[:, :, None] - x.rest[:, None]
        return ops.softmax(-((apart ** 2).sum(-1) + 1e-6) * ctx.leaf(self.sharp), -1)


@restage.model("tiny/shift", role="transfer")
class Shift:
    """Moves the target to where the source is."""

    def __init__(self, scale: float = 1.0):
        self.scale = restage.Parameter(np.float32([scale]))

    def forward(self, ctx, x):
        n, t, v = *x.pose.shape[:2], x.identity.shape[1]
        moved = (x.pose.mean(2) * ctx.leaf(self.scale)).reshape(n, t, 1, 3)
        return ops.expand(x.identity.reshape(n, 1, v, 3), (n, t, v, 3)) + ops.expand(moved, (n, t, v, 3))
