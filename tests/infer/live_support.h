// Bytes through the parser of streams, however they are cut.
#pragma once

#include <string>
#include <vector>

#include "infer/live/frame_parser.h"

namespace restage::live {

/// What a parser makes of bytes that come in pieces of `piece`.
struct Parsed {
  std::vector<LiveCloud> clouds;
  std::vector<std::string> refused;
  std::string garbage;
  bool in_frame = false;
};

inline Parsed parsed(const std::string& bytes, size_t piece) {
  Parsed out;
  FrameParser parser;
  for (size_t at = 0; at < bytes.size() && out.garbage.empty(); at += piece) {
    const size_t count = std::min(piece, bytes.size() - at);
    out.garbage = parser.take(
        {reinterpret_cast<const unsigned char*>(bytes.data()) + at, count}, Clock::now(),
        [&](LiveCloud& cloud) { out.clouds.push_back(cloud); },
        [&](const std::string& why) { out.refused.push_back(why); });
  }
  out.in_frame = parser.in_frame();
  return out;
}

}  // namespace restage::live
