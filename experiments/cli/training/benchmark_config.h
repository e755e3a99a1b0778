// Keys of a benchmark's recipe in YAML (datasets/benchmark/recipe.h).
#pragma once

#include "datasets/benchmark/recipe.h"
#include "nn/config/config_reader.h"

namespace restage {

template <class V>
void visit(V& v, SplitRecipe& c) {
  v("bodies", c.bodies, "rows of bodies.csv");
  v("clips", c.clips, "clips of clips30.h5");
}

template <class V>
void visit(V& v, MoreClipsRecipe& c) {
  v("file", c.file, "packed clips of CMU, below the data folder", required());
  v("train", c.train, "all of its clips are in train.h5; else only those that the recipe names");
  v("without", c.without, "clips to leave out, by name or by a part of their attribute 'source'");
}

template <class V>
void visit(V& v, ShapeRecipe& c) {
  v("gender", c.gender, "0 female to 1 male", between(0, 1));
  v("age", c.age, "0.19 a child, 0.5 an adult, 1 old", between(0, 1));
  v("muscle", c.muscle, "0 to 1", between(0, 1));
  v("weight", c.weight, "0 to 1", between(0, 1));
  v("height", c.height, "0 to 1", between(0, 1));
  v("proportions", c.proportions, "0 to 1", between(0, 1));
}

template <class V>
void visit(V& v, CharacterRecipe& c) {
  v("id", c.id, "name", required());
  v("body", c.body, "row of bodies.csv; empty: shape");
  v("shape", c.shape, "sliders of a body of its own");
  v("garment", c.garment, "file of body/clothes; empty: naked");
  v("hair", c.hair, "thickness, metres", between(0, 0.2));
}

template <class V>
void visit(V& v, MotionRecipe& c) {
  v("id", c.id, "name", required());
  v("clip", c.clip, "clip of clips30.h5", required());
  v("first", c.first, "first frame", between(0, 1e6));
  v("frames", c.frames, "how many; 0: to the end", between(0, 1e6));
}

template <class V>
void visit(V& v, PairRecipe& c) {
  v("source", c.source, "character who is scanned", required());
  v("target", c.target, "character who performs it", required());
  v("motions", c.motions, "which; empty: all");
}

template <class V>
void visit(V& v, ScannerNoise& c) {
  v("base", c.base, "standard deviation along the ray at no distance, metres", between(0, 1));
  v("growth", c.growth, "grows by this times the squared distance", between(0, 1));
  v("dropout", c.dropout, "share of pixels without answer", between(0, 1));
  v("grazing", c.grazing, "cosine below which surfaces answer ever more rarely", between(0, 1));
  v("mixed", c.mixed, "share of outline pixels that mix front and back", between(0, 1));
  v("edge", c.edge, "step in depth that is an outline, metres", positive());
  v("behind", c.behind, "what an outline against nothing mixes with, metres", between(0, 10));
  v("outliers", c.outliers, "stray points as a share of the others", between(0, 1));
}

template <class V>
void visit(V& v, ScannerRecipe& c) {
  v("id", c.id, "name", required());
  v("cameras", c.cameras, "on the ring", between(1, 64));
  v("pixels", c.pixels, "width and height of an image", between(16, 2048));
  v("margin", c.margin, "from the path's edge to the cameras, metres", between(0.5, 50));
  v("azimuth", c.azimuth, "of the first camera, degrees from the front", between(-360, 360));
  v("heights", c.heights, "of the cameras in turn, metres", between(-10, 50));
  v.check("heights", !c.heights.empty(), "is empty", "give one height or more");
  v("view", c.view, "opening angle, degrees", between(5, 150));
  v("least_kept", c.least_kept, "a frame keeps this share of its points or more", between(0, 1));
  v("noise", c.noise, "errors of the cameras");
}

template <class V>
void visit(V& v, ScanRecipe& c) {
  v("scanner", c.scanner, "which", required());
  v("motion", c.motion, "which", required());
  v("source", c.source, "character who is scanned", required());
  v("target", c.target, "character who performs it", required());
  v("intruder", c.intruder, "character whose arm reaches into view; empty: nobody");
  v("known_frame", c.known_frame, "metres, y up, facing +z; else drawn from the seed");
}

template <class V>
void visit(V& v, BenchmarkRecipe& c) {
  v("protocol", c.protocol, "name and version");
  v("seed", c.seed, "of everything random");
  v("rotations", c.rotations, "truths hold world rotations", added("false"));
  v("floor_window", c.floor_window, "seconds within which a foot touches the floor; 0: as recorded",
    between(0, 10));
  v("vertices", c.vertices, "that all bodies keep, the same ones; 0: all",
    added("0", between(0, 1e6)));
  v("train", c.train, "train.h5");
  v("validation", c.validation, "validation.h5");
  v("test", c.test, "test.h5");
  v("more", c.more, "further clips", added("[]"));
  v("characters", c.characters, "people of the sets below");
  v("motions", c.motions, "motions of the sets below");
  v("naked", c.naked, "pairs of naked/");
  v("clothed", c.clothed, "pairs of clothed/");
  v("scanners", c.scanners, "virtual scanners");
  v("scans", c.scans, "sequences of scans/");
}

}  // namespace restage
