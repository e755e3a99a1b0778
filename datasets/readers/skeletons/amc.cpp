// The frames of an AMC file; its skeleton is in asf.cpp.
#include <algorithm>
#include <cmath>
#include <map>

#include "autograd/base/nearest.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/skeletons/asf.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

bool is_number(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

class AmcParser {
 public:
  AmcParser(std::string_view text, const std::string& path, const AsfFile& skeleton)
      : lines_(text, path), skeleton_(skeleton), given_(skeleton.bones.size(), 0) {
    for (size_t b = 0; b < skeleton.bones.size(); ++b) {
      index_[skeleton.bones[b].name] = b;
      first_.push_back(width_);
      width_ += skeleton.bones[b].freedoms.size();
    }
    amc_.radians = skeleton.radians;
  }

  AmcFile parse() {
    while (lines_.next()) {
      const auto& words = lines_.words();
      if (words[0][0] == '#') continue;
      if (words[0][0] == ':') {
        if (same_word(words[0], ":radians")) amc_.radians = true;
        if (same_word(words[0], ":degrees")) amc_.radians = false;
      } else if (words.size() == 1 && is_number(words[0])) {
        begin_frame();
      } else if (amc_.frames.empty()) {
        lines_.fail("a frame's number expected before the values of bones", "give an AMC file");
      } else {
        bone_values();
      }
    }
    if (amc_.frames.empty()) lines_.fail("holds no frames", "give a whole AMC file");
    end_frame();
    return std::move(amc_);
  }

 private:
  void begin_frame() {
    if (!amc_.frames.empty()) end_frame();
    const auto number = static_cast<int64_t>(lines_.number(lines_.words()[0]));
    if (!amc_.frames.empty() && number <= amc_.numbers.back())
      lines_.fail(cat("frame ", number, " follows frame ", amc_.numbers.back()),
                  "give one recording, its frames in order");
    amc_.numbers.push_back(number);
    amc_.frames.emplace_back(width_, 0.0);
    given_.assign(given_.size(), 0);
  }

  void end_frame() const {
    for (size_t b = 0; b < given_.size(); ++b)
      if (!given_[b] && !skeleton_.bones[b].freedoms.empty())
        lines_.fail(cat("frame ", amc_.numbers.back(), " lacks bone ", skeleton_.bones[b].name),
                    "give the whole file, with its own skeleton");
  }

  void bone_values() {
    const auto& words = lines_.words();
    const std::string name = WordLines::quoted(words[0]);  // for messages
    const auto at = index_.find(std::string(words[0]));
    if (at == index_.end()) {
      std::vector<std::string> known;
      for (const auto& entry : index_) known.push_back(entry.first);
      const std::string close = nearest(name, known);
      lines_.fail("bone '" + name + "' is not in the skeleton",
                  close.empty() ? "give the ASF file that belongs to it"
                                : "did you mean '" + close + "'? Or give its own ASF file");
    }
    const size_t bone = at->second, count = skeleton_.bones[bone].freedoms.size();
    if (given_[bone]) lines_.fail("bone " + name + " twice in one frame", "keep one");
    if (words.size() != count + 1)
      lines_.fail(cat("bone ", name, " has ", words.size() - 1, " values, its skeleton has ", count,
                      " freedoms"),
                  "give the ASF file that belongs to it");
    given_[bone] = 1;
    for (size_t i = 0; i < count; ++i) {
      const double value = lines_.number(words[i + 1]);
      const AsfFreedom& freedom = skeleton_.bones[bone].freedoms[i];
      if (bone > 0 && (!freedom || !is_rotation(*freedom)))
        amc_.largest_unused = std::max(amc_.largest_unused, std::abs(value));
      amc_.frames.back()[first_[bone] + i] = value;
    }
  }

  WordLines lines_;
  const AsfFile& skeleton_;
  AmcFile amc_;
  std::map<std::string, size_t> index_;
  std::vector<size_t> first_;  // value of each bone
  std::vector<uint8_t> given_;
  size_t width_ = 0;
};

}  // namespace

AmcFile parse_amc(std::string_view text, const std::string& path, const AsfFile& skeleton) {
  return AmcParser(text, path, skeleton).parse();
}

}  // namespace restage
