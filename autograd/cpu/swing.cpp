// Swing and twist: baseline code.
#include "autograd/base/parallel_each.h"
#include "autograd/cpu/buffer.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/kernels/swing_rows.h"

namespace restage::cpu {
namespace {

struct Arc {
  swing_rows::Mat operator()(const swing_rows::Vec& a, const swing_rows::Vec& b) const {
    return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix();
  }
};

/// Kept by the thread: a steady frame takes no memory.
double* room(int64_t count) {
  thread_local Buffer<double> kept;
  return kept.at_least(count);
}

}  // namespace

void swing_twist(const SwingTwistArgs& args) {
  const auto j = static_cast<int64_t>(args.joints.size());
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.posed.size(0), 16, [&](int64_t s) {
      swing_rows::Walk<T, Arc>(args.joints.data(), j, args.rest.data<T>() + 3 * j * s,
                               args.posed.data<T>() + 3 * j * s, args.twist.data<T>() + j * s,
                               room(swing_rows::kWalkRoom * j))
          .write(args.out.data<T>() + 9 * j * s);
    });
  });
}

void swing_twist_grad(const SwingTwistGradArgs& args) {
  const auto j = static_cast<int64_t>(args.joints.size());
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.posed.size(0), 16, [&](int64_t s) {
      swing_rows::WalkBack<T, Arc>(args.joints.data(), j, args.rest.data<T>() + 3 * j * s,
                                   args.posed.data<T>() + 3 * j * s, args.twist.data<T>() + j * s,
                                   room(swing_rows::kWalkBackRoom * j))
          .run(args.gy.data<T>() + 9 * j * s, args.g_rest.data<T>() + 3 * j * s,
               args.out.data<T>() + 3 * j * s, args.g_twist.data<T>() + j * s);
    });
  });
}

}  // namespace restage::cpu
