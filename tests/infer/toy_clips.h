// Something to draw, for the tests of pictures and pages.
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "infer/render/clip.h"
#include "tests/infer/toy_body.h"

namespace restage::testing {

/// Source cloud of changing size, result, truth.
inline std::vector<Clip> toy_clips(size_t frames = 12) {
  const Body body = toy_body();
  std::vector<Clip> clips = {
      {"source cloud", {}, {}}, {"result", {}, body.rest.faces}, {"truth", {}, body.rest.faces}};
  for (size_t f = 0; f < frames; ++f) {
    const Points surface = linear_blend_skinning(body, toy_pose(body, static_cast<double>(f) / 24));
    clips[0].frames.push_back(
        Points(surface.begin(), surface.end() - static_cast<std::ptrdiff_t>(10 * f)));
    clips[1].frames.push_back(surface);
    clips[2].frames.push_back(surface);
  }
  return clips;
}

/// RESTAGE_KEEP=FOLDER keeps the files for the browser and for a look.
inline void keep(const std::string& name, const std::string& bytes) {
  if (const char* folder = std::getenv("RESTAGE_KEEP"))
    write_file_atomically(std::string(folder) + "/" + name, bytes);
}

}  // namespace restage::testing
