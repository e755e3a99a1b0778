# Made by 'restage completion python': what the functions take as keywords, which are the program's options
# with _ for -.
import os
from typing import Literal, Sequence, TypedDict, Union

Text = Union[str, bytes, os.PathLike[str], os.PathLike[bytes]]

class RetargetOptions(TypedDict, total=False):
    seed: int | None  # seed of all random numbers (default: 0)
    verbose: bool  # print more about what is done
    max_memory: Text | None  # most that an array of a file may take, unpacked (default: 4GB, of HDF5 16GiB)
    bones: Text | None  # which bone of a glTF target is which joint, a .yaml file or a known family (default: found)
    source_bones: Text | None  # the same of a source's skeleton (default: found)
    layout: Text | None  # of a source of joints without rotations, in which order they are: smpl22, h36m17, coco17, coco133, mediapipe33, openpose25, kinect25, azure32, humanml263 or another (default: the one that fits)
    asf: Text | None  # of an AMC source its skeleton (default: the one beside)
    body_model: Text | None  # of an AMASS source or a pose estimator's its SMPL model (.npz), or a folder of them (default: none)
    person: Text | None  # of a source that shows several people this one: from 0, or as an estimator's file calls it; in clouds they are counted from -x to +x in the first frame (default: none)
    system: Text | None  # chain: extractor, motion network and deformation of the weights; copy: no motion network: the rotations of the source's joints, copied as rig tools do; refine: the chain's answer, then fitted to each cloud; register: no learning: the target is registered to each cloud, then reposed; transfer: one network that moves vertices, without a skeleton (NPT, LART, 3D-CoreNet); h4d: codes of shape, pose and motion of windows of clouds (H4D) (default: chain)
    rest: Text | None  # the target's 22 rest joints (HDF5, /joints [1, 22, 3]) (default: found)
    every: int | None  # only every so many frames of the source; for X.h5 (default: 1)
    clip_name: Text | None  # of the animation that a rigged target's file gets (default: the source's name)
    skeleton: Text | None  # names and axes of the bones that a target without a rig gets: restage, smpl, mixamo, vrm, unreal (default: restage)
    animation_only: bool  # of a rigged target only nodes and the animation, without meshes
    out_fps: float | None  # frames per second of an animation, such as 24 or 60 (default: 30)
    joints: Text | None  # for X.h5: convert /joints to this definition, smpl or makehuman (default: the weights' own)
    clip: Text | None  # animation of a glTF source (default: the first), or motion of a file of motions
    sequence: int | None  # which sequence of an HDF5 source, from 0 (default: the only one)
    fps: float | None  # frames per second of the source (default: the file's, else 30)
    source_up: Text | None  # the source's axis that points up: x, -x, y, -y, z or -z (default: y)
    scale: float | str | None  # the source's units in metres; a number or mm, cm, m, in, ft (default: 1)
    format: Text | None  # of a folder's frames: ply or obj (default: the target's own, else ply)
    device: Text | None  # where extractor and motion network run: cpu, or cuda in a program built for it (default: cpu)
    samples: int | None  # views of a cloud to average: choices of its points, turned and mirrored (default: 4)
    anchor: float | None  # seconds in which the path goes back to the source's, scaled to the target's legs (0: never) (default: 0.25)
    min_confidence: float | None  # the target waits where the extractor is less sure than this, 0 to 1 (0: never), and comes back within half a second (default: 0)
    foot_lock: bool  # False: feet that stand are not held where they landed
    floor: Literal["on", "off"] | None  # on: soles stand on the floor, and no foot goes below it; off (default: on, but for X.h5 of a target without bones)
    contacts: Literal["on", "off"] | None  # on: arms are moved so that hands touch what the source's hands touch, and go no deeper into the body; off (default: on, but for X.h5 of a target without bones, and for arms and trunks like the source's)
    keep_limbs: bool  # False: legs and arms that cross are named as each frame shows them
    steady_bones: bool  # False: the source's bones are as long as each frame shows them
    online: bool  # every frame is answered at once, as in 'restage stream'; else weights that can look two frames ahead do so
    force: bool  # take what the doctor would refuse: a target that is no T-pose, clouds in which nobody is found, gaps of over a third of a second
    from_surface: bool  # look at the surface of a source that has a skeleton, as if it had been scanned
    profile: bool  # say how long a frame and its parts take: p50, p95, p99, max

class SystemOptions(TypedDict, total=False):
    seed: int | None  # seed of all random numbers (default: 0)
    verbose: bool  # print more about what is done
    max_memory: Text | None  # most that an array of a file may take, unpacked (default: 4GB, of HDF5 16GiB)
    bones: Text | None  # which bone of a glTF target is which joint, a .yaml file or a known family (default: found)
    system: Text | None  # chain: extractor, motion network and deformation of the weights; copy: no motion network: the rotations of the source's joints, copied as rig tools do; refine: the chain's answer, then fitted to each cloud; register: no learning: the target is registered to each cloud, then reposed; transfer: one network that moves vertices, without a skeleton (NPT, LART, 3D-CoreNet); h4d: codes of shape, pose and motion of windows of clouds (H4D) (default: chain)
    rest: Text | None  # the target's 22 rest joints (HDF5, /joints [1, 22, 3]) (default: found)
    device: Text | None  # where extractor and motion network run: cpu, or cuda in a program built for it (default: cpu)
    samples: int | None  # views of a cloud to average: choices of its points, turned and mirrored (default: 4)
    anchor: float | None  # seconds in which the path goes back to the source's, scaled to the target's legs (0: never) (default: 0.25)
    min_confidence: float | None  # the target waits where the extractor is less sure than this, 0 to 1 (0: never), and comes back within half a second (default: 0)
    foot_lock: bool  # False: feet that stand are not held where they landed
    floor: Literal["on", "off"] | None  # on: soles stand on the floor, and no foot goes below it; off (default: on, but for X.h5 of a target without bones)
    contacts: Literal["on", "off"] | None  # on: arms are moved so that hands touch what the source's hands touch, and go no deeper into the body; off (default: on, but for X.h5 of a target without bones, and for arms and trunks like the source's)
    keep_limbs: bool  # False: legs and arms that cross are named as each frame shows them
    steady_bones: bool  # False: the source's bones are as long as each frame shows them
    online: bool  # False: weights that can look two frames ahead do so
    fps: float | None  # frames per second of the clouds (default: 30)
    source_up: Text | None  # the source's axis that points up: x, -x, y, -y, z or -z (default: y)
    scale: float | str | None  # the clouds' units in metres; a number or mm, cm, m, in, ft (default: 1)
    force: bool  # take what the doctor would refuse: a target that is no T-pose, clouds in which nobody is found

class DoctorOptions(TypedDict, total=False):
    seed: int | None  # seed of all random numbers (default: 0)
    verbose: bool  # print more about what is done
    max_memory: Text | None  # most that an array of a file may take, unpacked (default: 4GB, of HDF5 16GiB)
    self: bool  # examine the program: instruction set, threads, weights, GPU, time of a frame
    picture: Text | None  # draw it from front, side and top (PNG) (default: none)
    fix: Text | None  # write it mended: X.ply or X.obj (one cloud or surface), X.h5 (a sequence), or a folder of frames (default: none)
    people: bool  # say who is in a sequence of clouds; with --fix X.h5 write a sequence of each
    as_target: bool  # it is meant as a target: in T-pose, facing +z
    scale: float | str | None  # metres per unit, where you know better; a number or mm, cm, m, in, ft (default: found)
    up: Text | None  # the direction that is up: x, y, z, --up=-x ... (default: found)
    fps: float | None  # frames per second of a sequence, where you know better than the file (default: the file's, else 30)
    facing: Text | None  # the direction that the person faces, as --up (default: found)
    bones: Text | None  # which bone of a character or recording is which joint, a .yaml file or a known family (default: found)

class TrainOptions(TypedDict, total=False):
    seed: int | None  # seed of all random numbers (default: 0)
    verbose: bool  # print more about what is done
    max_memory: Text | None  # most that an array of a file may take, unpacked (default: 4GB, of HDF5 16GiB)
    print_config: bool  # print the resolved configuration and end
    dry_run: bool  # check all, forecast time and memory from some steps of each stage, write nothing
    fast_dev_run: bool  # three steps, a validation and a checkpoint of each stage; keep nothing
    find_rate: Text | None  # let each stage's rate grow over 100 steps, suggest one, draw the loss as F.svg; write nothing else (default: none)
    overfit_batches: int | None  # train on the same N batches again and again: can they be learned? (default: no)
    profile: Text | None  # time ops and modules; a table in the log, and F.json for Perfetto or chrome://tracing (default: none)
    tensorboard: bool  # event files in RUN/tensorboard
    csv: bool  # RUN/metrics.csv besides metrics.jsonl
