#include "datasets/readers/skeletons/bvh.h"

#include <cmath>
#include <cstdlib>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr size_t kMaxJoints = 4096, kMaxName = 1000;
constexpr double kLeastTime = 1e-4, kMostTime = 1;  // seconds of a frame

Channel channel_of(const WordLines& lines, std::string_view word) {
  constexpr std::pair<std::string_view, Channel> kNames[] = {
      {"xposition", Channel::x_position}, {"yposition", Channel::y_position},
      {"zposition", Channel::z_position}, {"xrotation", Channel::x_rotation},
      {"yrotation", Channel::y_rotation}, {"zrotation", Channel::z_rotation}};
  for (const auto& [name, channel] : kNames)
    if (same_word(word, name)) return channel;
  lines.fail("'" + WordLines::quoted(word) + "' is no channel",
             "use Xposition, Yposition, Zposition, Xrotation, Yrotation, Zrotation");
}

/// Reads HIERARCHY up to the line with MOTION. Braces may stand on lines of their own or not.
class HierarchyParser {
 public:
  HierarchyParser(WordLines& lines, BvhFile& file) : lines_(lines), file_(file) {}

  void parse() {
    if (!lines_.next()) lines_.fail("is empty", "give a BVH file");
    if (!same_word(lines_.words()[0], "hierarchy"))
      lines_.fail("does not begin with HIERARCHY", "give a BVH file");
    while (lines_.next()) {
      const auto& words = lines_.words();
      if (same_word(words[0], "motion")) return finish();
      statement(words);
    }
    lines_.fail("ends before MOTION", "give the whole file");
  }

 private:
  void statement(const std::vector<std::string_view>& words) {
    const std::string_view key = words[0];
    if (key == "{" && words.size() == 1) {
      if (!opening_) lines_.fail("'{' without a joint before it", "mend the hierarchy");
      opening_ = false;
    } else if (key == "}" && words.size() == 1) {
      close();
    } else if (opening_) {
      lines_.fail("'{' expected after a joint's name", "mend the hierarchy");
    } else if (same_word(key, "root") || same_word(key, "joint")) {
      begin_joint(words, same_word(key, "root"));
    } else if (same_word(key, "end")) {
      begin_end(words);
    } else if (same_word(key, "offset")) {
      offset(words);
    } else if (same_word(key, "channels")) {
      channels(words);
    } else {
      lines_.fail("'" + WordLines::quoted(key) + "' is not known in a hierarchy",
                  "use ROOT, JOINT, End Site, OFFSET, CHANNELS and braces");
    }
  }

  void begin_joint(const std::vector<std::string_view>& words, bool root) {
    SourceSkeleton& s = file_.skeleton;
    if (root != open_.empty() || (root && s.size() > 0))
      lines_.fail(root ? "a second ROOT" : "JOINT outside of the ROOT",
                  "a file holds one skeleton with one root");
    if (!open_.empty() && open_.back() < 0)
      lines_.fail("a JOINT in an End Site", "mend the hierarchy");
    if (s.size() >= kMaxJoints) lines_.fail("more than 4096 joints", "give a skeleton of a person");
    const bool brace = words.back() == "{" && words.size() > 1;
    std::string name;
    for (size_t i = 1; i < words.size() - (brace ? 1 : 0); ++i)
      name += cat(i > 1 ? "_" : "", words[i]);
    if (name.empty()) lines_.fail("a joint without a name", "give it one");
    if (name.size() > kMaxName) lines_.fail("a joint's name of more than 1000 bytes", "shorten it");
    s.add(name, open_.empty() ? -1 : open_.back(), Vec3::Zero());
    file_.channels.emplace_back();
    has_channels_.push_back(0);
    open_.push_back(static_cast<int>(s.size()) - 1);
    opening_ = !brace;
  }

  void begin_end(const std::vector<std::string_view>& words) {
    if (open_.empty() || open_.back() < 0) lines_.fail("an End Site outside of a joint", "mend it");
    open_.push_back(-1);
    opening_ = words.back() != "{";
  }

  void offset(const std::vector<std::string_view>& words) {
    if (open_.empty()) lines_.fail("OFFSET outside of a joint", "mend the hierarchy");
    if (words.size() != 4)
      lines_.fail("OFFSET needs three numbers", "write OFFSET x y z, with decimal points");
    const Vec3 value(lines_.number(words[1]), lines_.number(words[2]), lines_.number(words[3]));
    SourceSkeleton& s = file_.skeleton;
    if (open_.back() >= 0) {
      s.offsets[open_.back()] = value;
    } else {
      const size_t joint = static_cast<size_t>(open_[open_.size() - 2]);
      s.ends[joint] = value;
      s.has_end[joint] = 1;
    }
  }

  void channels(const std::vector<std::string_view>& words) {
    if (open_.empty() || open_.back() < 0) lines_.fail("CHANNELS outside of a joint", "mend it");
    const size_t joint = static_cast<size_t>(open_.back());
    if (has_channels_[joint]) lines_.fail("CHANNELS given twice for one joint", "keep one");
    has_channels_[joint] = 1;
    if (words.size() < 2 || words.size() > 8 ||
        lines_.number(words[1]) != static_cast<double>(words.size() - 2))
      lines_.fail("CHANNELS has another count than names",
                  "write CHANNELS n and n names, n up to 6");
    std::vector<Channel>& out = file_.channels[joint];
    for (size_t i = 2; i < words.size(); ++i) {
      const Channel channel = channel_of(lines_, words[i]);
      for (const Channel other : out)
        if (other == channel) lines_.fail("a channel given twice for one joint", "keep one");
      out.push_back(channel);
    }
  }

  void close() {
    if (open_.empty() || opening_) lines_.fail("'}' without '{'", "mend the hierarchy");
    open_.pop_back();
  }

  void finish() {
    if (!open_.empty() || opening_)
      lines_.fail("MOTION before all braces are closed", "mend the hierarchy");
    if (file_.skeleton.size() == 0) lines_.fail("no ROOT before MOTION", "give a BVH file");
    for (const auto& channels : file_.channels) {
      file_.first_channel.push_back(file_.channel_count);
      file_.channel_count += channels.size();
    }
    if (file_.channel_count == 0) lines_.fail("no joint has channels", "give a file with motion");
  }

  WordLines& lines_;
  BvhFile& file_;
  std::vector<int> open_;  // joints whose braces are open; -1: an end site
  std::vector<uint8_t> has_channels_;
  bool opening_ = false;  // a name was read, its brace not yet
};

/// Whether a comma alone stands between digits of these words of one line: "0,0333".
bool is_decimal_comma(std::string_view before, std::string_view after) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return before.data() + before.size() + 1 == after.data() && before.data()[before.size()] == ',' &&
         digit(before.back()) && digit(after[0]);
}

/// "Frames: 12" or "Frame Time : 0.01": what is written after the colon. In a `decimal` a comma
/// between digits is a decimal point.
std::string header_value(WordLines& lines, const std::string& title, bool decimal = false) {
  std::string joined;
  if (lines.next())
    for (size_t i = 0; i < lines.words().size() && joined.size() <= 100; ++i) {
      const std::string_view word = lines.words()[i];
      const bool comma = i > 0 && decimal && is_decimal_comma(lines.words()[i - 1], word);
      joined += cat(i == 0 ? "" : comma ? "." : " ", word.substr(0, 100));
    }
  const size_t colon = joined.find(':');
  const size_t end = joined.find_last_not_of(' ', colon - (colon > 0 ? 1 : 0)) + 1;
  if (colon == std::string::npos || !same_word(std::string_view(joined).substr(0, end), title))
    lines.fail("'" + title + ": NUMBER' expected", "give the whole file");
  const size_t begin = joined.find_first_not_of(' ', colon + 1);
  return begin == std::string::npos ? std::string() : joined.substr(begin);
}

/// "0.0333" -> 0.0001, "8.33e-3" -> 0.00001.
double last_digit(const std::string& number) {
  const size_t e = number.find_first_of("eE"), point = number.find('.');
  const size_t end = std::min(e, number.size());
  double power = point < end ? -static_cast<double>(end - point - 1) : 0;
  if (e != std::string::npos) power += std::strtod(number.c_str() + e + 1, nullptr);
  return std::pow(10.0, power);
}

void parse_frames(WordLines& lines, BvhFile& file, bool rate_is_told) {
  const double announced = lines.number(header_value(lines, "frames"));
  if (!(announced >= 1) || announced != std::floor(announced))
    lines.fail("no frames announced", "give a file with at least one frame");
  const std::string frame_time = header_value(lines, "frame time", true);
  file.frame_time = lines.number(frame_time);
  file.frame_time_digit = last_digit(frame_time);
  if (!rate_is_told && !(file.frame_time >= kLeastTime && file.frame_time <= kMostTime))
    lines.fail("frame time " + WordLines::quoted(frame_time) + " s is not usable",
               "give the true rate with {fps}, or write seconds per frame, between 0.0001 and 1");
  while (lines.next()) {
    if (static_cast<double>(file.frames.size()) >= announced) {
      ++file.lines_left_out;
      continue;
    }
    const auto& words = lines.words();
    if (words.size() != file.channel_count)
      lines.fail(cat("frame ", file.frames.size(), " has ", words.size(),
                     " values, the hierarchy has ", file.channel_count, " channels"),
                 words.size() == 2 * file.channel_count
                     ? "write decimals with points, not with commas"
                     : "give the whole file, one frame a line");
    std::vector<double>& frame = file.frames.emplace_back();
    frame.reserve(words.size());
    for (const std::string_view word : words) frame.push_back(lines.number(word));
  }
  if (static_cast<double>(file.frames.size()) != announced)
    lines.fail(cat("ends after ", file.frames.size(), " of ", static_cast<long long>(announced),
                   " frames"),
               "give the whole file");
}

}  // namespace

BvhFile parse_bvh(std::string_view text, const std::string& path, bool rate_is_told) {
  BvhFile file;
  WordLines lines(text, path);
  HierarchyParser(lines, file).parse();
  parse_frames(lines, file, rate_is_told);
  return file;
}

}  // namespace restage
