#include "datasets/importers/joints/believed.h"

#include <algorithm>
#include <cmath>

#include "datasets/importers/joints/skeleton_of.h"

namespace restage::joints_detail {
namespace {

// ---- what the network believes ------------------------------------------------------------------

/// The frame `moments` 30ths of a second away, between two frames of the file; nothing beyond them.
std::optional<SeenFrame> frame_at(const std::vector<MappedFrame>& frames, size_t f, int moments,
                                  double fps) {
  const double at = static_cast<double>(f) + moments / kFps * fps;
  const double last = static_cast<double>(frames.size() - 1);
  if (at < -1e-6 || at > last + 1e-6) return {};
  const auto a = static_cast<size_t>(std::clamp(std::floor(at + 1e-6), 0.0, last));
  const size_t b = std::min(a + 1, frames.size() - 1);
  const double t = std::clamp(at - static_cast<double>(a), 0.0, 1.0);
  SeenFrame out;
  for (size_t j = 0; j < kJoints; ++j) {
    const auto &x = frames[a].joints[j], &y = frames[b].joints[j];
    if (x && y) out[j] = Vec3((1 - t) * *x + t * *y);
  }
  return out;
}

/// A frame and those around it, in the order of kMoments; null: there is none.
using Around = std::array<const SeenFrame*, kMoments.size()>;

/// The axes that one moment is looked at in; of an unknown trunk the world's.
Trunk trunk_or_world(const SeenFrame& here) {
  return trunk_of(here).value_or(Trunk{Mat3::Identity(), Vec3::Zero()});
}

void look(const Around& around, float* input) {
  const SeenFrame& here = *around[0];
  fill_input(around, trunk_or_world(here), std::max(0.05, trunk_length(here)), input);
}

/// What the network answers for `seen`, [n, kInputs], of which `here(i)` is moment i.
template <class Here, class Take>
void ask(const Tensor& seen, const Here& here, const Take& take) {
  Context ctx;
  const TurnAnswer answer = answer_of(turn_net()(ctx, seen));
  const float* turns = answer.turns.value.data<float>();
  const float* errors = answer.log_error.value.data<float>();
  // Two columns differ by 2 / sqrt(3) of the angle, on average over axes.
  const double to_angle = std::sqrt(3.0) / 2;
  for (size_t i = 0; i < static_cast<size_t>(seen.size(0)); ++i) {
    const Mat3 axes = trunk_or_world(here(i)).axes;
    BelievedNow now;
    for (size_t j = 0; j < kJoints; ++j) {
      now.turns[j] = axes * matrix_at(turns + 9 * (i * kJoints + j)).cast<double>();
      now.error[j] = std::min(M_PI, to_angle * std::exp(double{errors[i * kJoints + j]}));
    }
    take(now);
  }
}

void ask(const std::vector<MappedFrame>& frames, double fps, size_t first, size_t count,
         Believed* out) {
  Tensor seen = Tensor::empty({static_cast<int64_t>(count), kInputs});
  for (size_t i = 0; i < count; ++i) {
    std::array<std::optional<SeenFrame>, kMoments.size()> around;
    Around pointers{};
    for (size_t m = 0; m < kMoments.size(); ++m) {
      around[m] = frame_at(frames, first + i, kMoments[m], fps);
      pointers[m] = around[m] ? &*around[m] : nullptr;
    }
    look(pointers, seen.data<float>() + i * kInputs);
  }
  ask(
      seen, [&](size_t i) -> const SeenFrame& { return frames[first + i].joints; },
      [&](const BelievedNow& now) {
        out->turns.push_back(now.turns);
        for (size_t j = 0; j < kJoints; ++j)
          out->error[j] += now.error[j] / static_cast<double>(frames.size());
      });
}

/// Turns averaged over a tenth of a second, as far to one side as to the other.
void calm(std::vector<Rotations>& turns, double fps) {
  const double sigma = fps / kFps;
  const auto reach = static_cast<int64_t>(std::ceil(2 * sigma));
  const std::vector<Rotations> as_asked = turns;
  const auto n = std::ssize(turns);
  for (int64_t f = 0; f < n; ++f) {
    const int64_t side = std::min({reach, f, n - 1 - f});
    for (size_t j = 0; j < kJoints; ++j) {
      Mat3 sum = Mat3::Zero();
      for (int64_t k = -side; k <= side; ++k)
        sum += std::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma)) *
               as_asked[static_cast<size_t>(f + k)][j];
      turns[static_cast<size_t>(f)][j] =
          turn_between({Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()},
                       {sum.col(0), sum.col(1), sum.col(2)}, as_asked[static_cast<size_t>(f)][j]);
    }
  }
}

}  // namespace

Believed believed_turns(const CleanJoints& joints) {
  constexpr size_t kBatch = 512;
  Believed out;
  for (size_t f = 0; f < joints.frames.size(); f += kBatch)
    ask(joints.frames, joints.fps, f, std::min(kBatch, joints.frames.size() - f), &out);
  calm(out.turns, joints.fps);
  return out;
}

BelievedNow believed_now(const std::array<const SeenFrame*, kMoments.size()>& around) {
  Tensor seen = Tensor::empty({1, kInputs});
  look(around, seen.data<float>());
  BelievedNow out;
  ask(
      seen, [&](size_t) -> const SeenFrame& { return *around[0]; },
      [&](const BelievedNow& now) { out = now; });
  return out;
}

}  // namespace restage::joints_detail
