// Conversions of rotations, row by row: scalar geometry, baseline code.
#include "autograd/base/parallel_each.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/kernels/rotation_rows.h"

namespace restage::cpu {
namespace {

using namespace rotation_rows;

}  // namespace

void to_matrix(const ToMatrixArgs& args) {
  const int64_t width = args.x.size(-1);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.out.numel() / 9, 512, [&](int64_t i) {
      const T* x = args.x.data<T>() + i * width;
      Eigen::Map<M3<T>> r(args.out.data<T>() + 9 * i);
      switch (args.form) {
        case RotationForm::sixd:
          r = from_sixd(x);
          break;
        case RotationForm::quaternion:
          r = from_quaternion(x);
          break;
        case RotationForm::axis_angle:
          r = from_axis_angle(x);
          break;
      }
    });
  });
}

void to_matrix_grad(const ToMatrixGradArgs& args) {
  const int64_t width = args.x.size(-1);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.gy.numel() / 9, 512, [&](int64_t i) {
      const T* x = args.x.data<T>() + i * width;
      const M3<T> g = Eigen::Map<const M3<T>>(args.gy.data<T>() + 9 * i);
      T* out = args.out.data<T>() + i * width;
      switch (args.form) {
        case RotationForm::sixd:
          sixd_grad(x, g, out);
          break;
        case RotationForm::quaternion:
          quaternion_grad(x, g, out);
          break;
        case RotationForm::axis_angle:
          axis_angle_grad(x, g, out);
          break;
      }
    });
  });
}

void from_matrix(const FromMatrixArgs& args) {
  const int64_t width = args.out.size(-1);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.x.numel() / 9, 512, [&](int64_t i) {
      const T* x = args.x.data<T>() + 9 * i;
      T* out = args.out.data<T>() + i * width;
      if (args.form == RotationForm::quaternion) {
        to_quaternion(x, out);
      } else {
        to_axis_angle(x, out);
      }
    });
  });
}

}  // namespace restage::cpu
