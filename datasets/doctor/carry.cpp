#include "datasets/doctor/carry.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/words.h"

namespace restage {
namespace {

/// What a repair does to the values of a data set.
enum class Meaning { places, lengths, rotations, other };

Meaning meaning_of(const std::string& name, const h5::Shape& shape) {
  const int64_t last = shape.back();
  if ((name == "/joints" || name == "/vertices") && last == 3) return Meaning::places;
  if (name == "/radius") return Meaning::lengths;
  if (name == "/rotations" && last == 4) return Meaning::rotations;
  return Meaning::other;
}

/// What the writer of frames writes itself.
bool is_written_anyway(const std::string& name) {
  for (const char* known :
       {"/points", "/frame_offset", "/sequence_offset", "/faces", "/source_to_world", "/filled"})
    if (name == known) return true;
  return false;
}

using Visit = std::function<void(const std::string& name)>;

/// All data sets of a group and of the groups below it, and those groups.
void list_members(const h5::File& file, const std::string& group, int depth, const Visit& set,
                  const Visit& below) {
  constexpr int kDeepest = 16;  // a group may hold itself
  for (const std::string& child : file.children(group.empty() ? "/" : group)) {
    const std::string name = group + "/" + child;
    if (!file.is_group(name)) {
      set(name);
    } else if (depth < kDeepest) {
      below(name);
      list_members(file, name, depth + 1, set, below);
    }
  }
}

/// The data set, if it is one that can be read here and has a row for every frame.
std::optional<h5::Dataset> set_of_frames(const h5::File& file, const std::string& name,
                                         int64_t frames) {
  try {
    h5::Dataset set = file.dataset(name);
    if (!set.shape().empty() && set.rows() == frames) return set;
  } catch (const InputError&) {  // of a type or with a filter that no file of ours has
  }
  return std::nullopt;
}

template <class T>
void apply(Meaning meaning, const Similarity& move, std::vector<T>& values) {
  if (meaning == Meaning::lengths)
    for (T& x : values) x = static_cast<T>(move.scale * static_cast<double>(x));
  if (meaning == Meaning::places)
    for (size_t i = 0; i + 2 < values.size(); i += 3) {
      Eigen::Map<Eigen::Matrix<T, 3, 1>> p(&values[i]);
      p = move(Vec3(p.template cast<double>())).template cast<T>();
    }
  if (meaning != Meaning::rotations) return;
  const Quat turn(move.rotation);
  for (size_t i = 0; i + 3 < values.size(); i += 4) {  // w x y z
    const Quat q = turn * Quat(values[i], values[i + 1], values[i + 2], values[i + 3]);
    for (const auto& [k, x] : {std::pair(0, q.w()), {1, q.x()}, {2, q.y()}, {3, q.z()}})
      values[i + static_cast<size_t>(k)] = static_cast<T>(x);
  }
}

template <class T>
void carry(const h5::Dataset& set, const std::string& name, std::span<const int64_t> rows,
           Meaning meaning, const Similarity& move, h5::File& to) {
  h5::Dataset out =
      to.create_appendable<T>(name, h5::Shape(set.shape().begin() + 1, set.shape().end()));
  std::vector<T> values;
  for (const int64_t row : rows) {
    set.read_rows(row, 1, values);
    if (std::is_floating_point_v<T> && !move.is_identity()) apply(meaning, move, values);
    out.append<T>(values);
  }
}

void carry_text(const h5::Dataset& set, const std::string& name, std::span<const int64_t> rows,
                h5::File& to) {
  const std::vector<std::string> all = set.read_text();
  std::vector<std::string> kept;
  for (const int64_t row : rows) kept.push_back(all[static_cast<size_t>(row)]);
  to.write_text(name, kept);
}

/// Frames that have no cloud of the source behind them are numbered anew.
void carry_filled(const h5::File& from, std::span<const int64_t> rows, h5::File& to) {
  const std::vector<int64_t> was = from.read<int64_t>("/filled", {-1});
  const std::set<int64_t> filled(was.begin(), was.end());
  std::vector<int64_t> now;
  for (int64_t k = 0; k < std::ssize(rows); ++k)
    if (filled.contains(rows[static_cast<size_t>(k)])) now.push_back(k);
  to.write<int64_t>("/filled", {std::ssize(now)}, now);
}

/// The path of a result's source, if it is relative, is so to the result's own folder.
void move_source_path(const h5::File& from, h5::File& to) {
  namespace fs = std::filesystem;
  const std::optional<std::string> path = from.text("/source", "path");
  if (!path || fs::path(*path).is_absolute()) return;
  const auto folder = [](const h5::File& file) {
    return fs::absolute(file.path()).lexically_normal().parent_path();
  };
  to.set_text("/source", "path",
              (folder(from) / *path).lexically_normal().lexically_relative(folder(to)).string());
}

}  // namespace

std::vector<std::string> sets_of_frames(const h5::File& file, int64_t frames) {
  std::vector<std::string> out;
  const auto set = [&](const std::string& name) {
    if (!is_written_anyway(name) && set_of_frames(file, name, frames)) out.push_back(name);
  };
  list_members(file, "", 0, set, [](const std::string&) {});
  return out;
}

void carry_frames(const h5::File& from, int64_t frames, std::span<const int64_t> rows,
                  const Similarity& move, h5::File& to, std::vector<std::string>& remarks) {
  std::vector<std::string> lost, lost_attributes, as_they_stand;
  const auto note_attributes = [&](const std::string& object) {
    for (const std::string& name : to.copy_attributes(from, object))
      lost_attributes.push_back(name + " of " + object);
  };
  const auto carry_set = [&](const std::string& name) {
    if (is_written_anyway(name)) return;
    const auto set = set_of_frames(from, name, frames);
    const bool text = set && set->type() == h5::Type::text;
    if (!set || (text && set->shape().size() > 1)) {
      lost.push_back(name);
      return;
    }
    const Meaning meaning = meaning_of(name, set->shape());
    if (text)
      carry_text(*set, name, rows, to);
    else if (set->type() == h5::Type::integer)
      carry<int64_t>(*set, name, rows, meaning, move, to);
    else if (set->value_size() > sizeof(float))
      carry<double>(*set, name, rows, meaning, move, to);
    else
      carry<float>(*set, name, rows, meaning, move, to);
    note_attributes(name);
    if (meaning == Meaning::other && name != "/confidence" && !move.is_identity())
      as_they_stand.push_back(name);
  };
  list_members(from, "", 0, carry_set, [&](const std::string& group) {
    to.create_group(group);
    note_attributes(group);
  });
  note_attributes("/");
  if (from.has("/filled")) carry_filled(from, rows, to);
  if (from.has("/source")) move_source_path(from, to);
  if (!lost.empty())
    remarks.push_back("not kept, without a plain row for every frame: " + joined(lost));
  if (!lost_attributes.empty())
    remarks.push_back("attributes not kept: " + joined(lost_attributes));
  if (!as_they_stand.empty())
    remarks.push_back("kept as they stand, neither turned nor scaled: " + joined(as_they_stand));
}

}  // namespace restage
