#include "nn/geometry/joint_definition.h"

#include <algorithm>

#include "autograd/base/error.h"
#include "autograd/base/log.h"

namespace restage {

JointConversion::JointConversion(const JointDefinition& from, const JointDefinition& to,
                                 const std::string& where) {
  rows_.setZero();
  if (from == to) {
    rows_.setIdentity();
    return;
  }
  const bool there = from == "makehuman" && to == "smpl";
  if (!there && !(from == "smpl" && to == "makehuman"))
    throw InputError(
        where,
        (from.empty() ? "does not say which joints it holds" : "holds joints of '" + from + "'") +
            ", which cannot be turned into joints of '" + to + "'",
        "conversions exist between makehuman and smpl (docs/joints.md)");
  const JointTable& table = there ? kMakehumanToSmpl : kSmplToMakehuman;
  for (size_t row = 0; row < table.size(); ++row) {
    const auto joint = static_cast<size_t>(kMiddleAndLeft[row]);
    for (size_t k = 0; k < kJoints; ++k)
      rows_(kMiddleAndLeft[row], static_cast<int>(k)) = rows_(kMirror[joint], kMirror[k]) =
          table[row][k];
  }
}

Joints JointConversion::operator()(const Joints& joints) const {
  Joints out;
  for (int j = 0; j < kJoints; ++j) {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < kJoints; ++k) sum += rows_(j, k) * joints[static_cast<size_t>(k)];
    out[static_cast<size_t>(j)] = sum;
  }
  return out;
}

void JointConversion::convert(std::span<double> frames) const {
  using Frame = Eigen::Matrix<double, kJoints, 3, Eigen::RowMajor>;
  for (size_t at = 0; at + 3 * kJoints <= frames.size(); at += 3 * kJoints) {
    Eigen::Map<Frame> frame(&frames[at]);
    frame = (rows_ * frame).eval();
  }
}

JointDefinition checked_definition(const std::string& name, const std::string& where) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  if (name.size() > 40 || !std::all_of(name.begin(), name.end(), plain))
    throw InputError(where, "has a joint_definition that is no name",
                     "use at most 40 letters, digits, '_', '-' and '.'");
  return name;
}

JointDefinition common_definition(const std::vector<NamedDefinition>& all,
                                  const std::string& mend) {
  const NamedDefinition *first = nullptr, *builtin = nullptr;
  for (const NamedDefinition& one : all) {
    if (one.definition.empty()) continue;
    const NamedDefinition*& same = one.definition == "builtin" ? builtin : first;
    if (same == nullptr) same = &one;
    if (one.definition != same->definition)
      throw InputError(one.where,
                       "has joints of '" + one.definition + "', but " + same->where +
                           " has those of '" + same->definition + "'",
                       mend);
  }
  if (first != nullptr && builtin != nullptr)
    log_warning(builtin->where + " has joints of 'builtin', but " + first->where +
                " has those of '" + first->definition + "': they differ by some centimetres");
  if (first == nullptr) first = builtin;
  return first == nullptr ? "" : first->definition;
}

}  // namespace restage
