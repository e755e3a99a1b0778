// Swing and twist, a thread a skeleton.
#include "autograd/cuda/kernels.h"
#include "autograd/kernels/swing_rows.h"

namespace restage::cuda {
namespace {

constexpr int64_t kMostSwings = 128;  // a launch takes them by value

struct Swings {
  SwingJoint of[kMostSwings];
  explicit Swings(std::span<const SwingJoint> joints) {
    if (std::ssize(joints) > kMostSwings)
      throw Error("kernels of the GPU know skeletons of at most " + std::to_string(kMostSwings) +
                  " joints");
    std::copy(joints.begin(), joints.end(), of);
  }
};

struct Arc {
  RESTAGE_DEVICE swing_rows::Mat operator()(const swing_rows::Vec& a,
                                            const swing_rows::Vec& b) const {
    using swing_rows::Mat, swing_rows::Vec;
    const double k = 1 + a.dot(b);
    if (k > 1e-12) {
      const Vec v = a.cross(b);
      return (k - 1) * Mat::Identity() + swing_rows::cross_matrix(v) + v * v.transpose() / k;
    }
    const Vec other = fabs(a.x()) < 0.6 ? Vec(1, 0, 0) : Vec(0, 1, 0);
    const Vec axis = a.cross(other).normalized();  // half a turn about it
    return 2 * axis * axis.transpose() - Mat::Identity();
  }
};

template <class T>
void swing_twist_of(const SwingTwistArgs& args) {
  const T *rest = at<T>(args.rest), *posed = at<T>(args.posed), *twist = at<T>(args.twist);
  T* out = at<T>(args.out);
  const int64_t n = args.posed.size(0), j = std::ssize(args.joints),
                room = swing_rows::kWalkRoom * j;
  const Swings joints(args.joints);
  Tensor rooms = scratch(args.out, n * room);
  double* in = at<double>(rooms);
  each(n, [=] RESTAGE_DEVICE(int64_t s) {
    swing_rows::Walk<T, Arc>(joints.of, j, rest + 3 * j * s, posed + 3 * j * s, twist + j * s,
                             in + s * room)
        .write(out + 9 * j * s);
  });
}

template <class T>
void swing_twist_grad_of(const SwingTwistGradArgs& args) {
  const T *rest = at<T>(args.rest), *posed = at<T>(args.posed), *twist = at<T>(args.twist),
          *gy = at<T>(args.gy);
  T *g_posed = at<T>(args.out), *g_rest = at<T>(args.g_rest), *g_twist = at<T>(args.g_twist);
  const int64_t n = args.posed.size(0), j = std::ssize(args.joints),
                room = swing_rows::kWalkBackRoom * j;
  const Swings joints(args.joints);
  Tensor rooms = scratch(args.out, n * room);
  double* in = at<double>(rooms);
  each(n, [=] RESTAGE_DEVICE(int64_t s) {
    swing_rows::WalkBack<T, Arc>(joints.of, j, rest + 3 * j * s, posed + 3 * j * s, twist + j * s,
                                 in + s * room)
        .run(gy + 9 * j * s, g_rest + 3 * j * s, g_posed + 3 * j * s, g_twist + j * s);
  });
}

}  // namespace

void swing_twist(const SwingTwistArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), swing_twist_of, args)
}
void swing_twist_grad(const SwingTwistGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), swing_twist_grad_of, args)
}

}  // namespace restage::cuda
