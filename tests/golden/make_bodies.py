#!/usr/bin/python3
"""Writes bodies.json: reference values of the data folder's own tools (body.py, motion.py), for the
tests of body import, posing and linear blend skinning.   make_bodies.py DATA_FOLDER"""
import json, os, sys
import numpy as np

data = sys.argv[1]
sys.path.insert(0, os.path.join(data, 'tools'))
import body as B, motion as M

model = B.Model()
r = lambda x, n=7: np.round(np.asarray(x, 'f8'), n).tolist()


def matrix_quat(R):  # (..., 3, 3) -> x, y, z, w
    from scipy.spatial.transform import Rotation
    return Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat().reshape(R.shape[:-2] + (4,))


def sparse(W):
    return [[[int(j), float(np.float32(w[j]))] for j in np.nonzero(w)[0]] for w in W]


bodies = []
for n in (0, 97):
    row = B.rows()[n]
    b = B.build(model, B.row_targets(row))
    pick = np.linspace(0, len(b['vertices']) - 1, 200).astype(int)
    bodies.append(dict(row=n, id=row['id'], split=row['split'], pick=pick.tolist(), height=float(b['height']),
                       vertices=r(b['vertices'][pick]), joints=r(b['joints']), weights=sparse(b['weights'][pick]),
                       triangles=[len(b['triangles'])] + b['triangles'][[0, 5000, -1]].tolist()))
    if n == 0:
        keep, keep_pick = b, pick[::4]

poses = []
for clip, frames in (('07_01', (0, 40)), ('02_03', (5, 30))):
    c = M.load(clip)
    G, P = M.fk(c)
    names = c['names']
    daz = 'chest' in names
    source = G[:, [names.index(x) for x in (M.DAZ if daz else M.ASF)]]
    hips = P[:, [names.index(x) for x in (('lThigh', 'rThigh') if daz else ('lfemur', 'rfemur'))]].mean(1)
    hips = hips - [0, c['floor_y'], 0]
    R, t = M.pose(c, keep)
    for f in frames:
        V, J = B.lbs(keep['vertices'][keep_pick].astype('f8'), keep['weights'][keep_pick].astype('f8'),
                     keep['joints'].astype('f8'), R[f], t[f])
        poses.append(dict(clip=clip, frame=f, rest=r(c['rest22']), source=r(matrix_quat(source[f]), 9),
                          hips=r(hips[f]), world=r(R[f].reshape(22, 9), 8), root=r(t[f]), joints=r(J), surface=r(V)))

d = B.build(model, B.row_targets(B.rows()[0]), 'female_sportsuit01')
pick = np.linspace(0, len(d['vertices']) - 1, 40).astype(int)
garment = dict(name='female_sportsuit01', count=len(d['vertices']), triangles=len(d['triangles']), pick=pick.tolist(),
               vertices=r(d['vertices'][pick]))

out = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'bodies.json')
json.dump(dict(source='tools/body.py, tools/motion.py; CC0 bodies (MakeHuman), CMU motion', bodies=bodies, garment=garment,
               surface_pick=keep_pick.tolist(), poses=poses), open(out, 'w'), separators=(',', ':'))
print(os.path.getsize(out))
