// A thread a rotation.
#include "autograd/cuda/kernels.h"
#include "autograd/kernels/rotation_rows.h"

namespace restage::cuda {
namespace {

using namespace rotation_rows;

template <class T>
void to_matrix_of(const ToMatrixArgs& args) {
  const T* in = at<T>(args.x);
  T* out = at<T>(args.out);
  const int64_t width = args.x.size(-1);
  const RotationForm form = args.form;
  each(args.out.numel() / 9, [=] RESTAGE_DEVICE(int64_t i) {
    const T* x = in + i * width;
    Eigen::Map<M3<T>> r(out + 9 * i);
    r = form == RotationForm::sixd         ? from_sixd(x)
        : form == RotationForm::quaternion ? from_quaternion(x)
                                           : from_axis_angle(x);
  });
}

template <class T>
void to_matrix_grad_of(const ToMatrixGradArgs& args) {
  const T *in = at<T>(args.x), *gy = at<T>(args.gy);
  T* to = at<T>(args.out);
  const int64_t width = args.x.size(-1);
  const RotationForm form = args.form;
  each(args.gy.numel() / 9, [=] RESTAGE_DEVICE(int64_t i) {
    const T* x = in + i * width;
    const M3<T> g = Eigen::Map<const M3<T>>(gy + 9 * i);
    T* out = to + i * width;
    if (form == RotationForm::sixd)
      sixd_grad(x, g, out);
    else if (form == RotationForm::quaternion)
      quaternion_grad(x, g, out);
    else
      axis_angle_grad(x, g, out);
  });
}

template <class T>
void from_matrix_of(const FromMatrixArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const int64_t width = args.out.size(-1);
  const bool quaternion = args.form == RotationForm::quaternion;
  each(args.x.numel() / 9, [=] RESTAGE_DEVICE(int64_t i) {
    if (quaternion)
      to_quaternion(x + 9 * i, out + i * width);
    else
      to_axis_angle(x + 9 * i, out + i * width);
  });
}

}  // namespace

void to_matrix(const ToMatrixArgs& args) { RESTAGE_FLOATS(args.out.dtype(), to_matrix_of, args) }
void to_matrix_grad(const ToMatrixGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), to_matrix_grad_of, args)
}
void from_matrix(const FromMatrixArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), from_matrix_of, args)
}

}  // namespace restage::cuda
