// Forward kinematics (spec 3.5): a few small products a sample, baseline code.
#include <Eigen/Core>
#include "autograd/base/parallel_each.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/kernels/scratch.h"

namespace restage::cpu {
namespace {

template <class T>
using V3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using M3 = Eigen::Matrix<T, 3, 3, Eigen::RowMajor>;
/// Rows [G | P] of one joint.
template <class T>
using M34 = Eigen::Matrix<T, 3, 4, Eigen::RowMajor>;

template <class T>
void fk_one(const FkArgs& args, int64_t s) {
  const int64_t joints = args.local.size(1);
  const T* rest = args.rest.data<T>() + s * joints * 3;
  T* out = args.out.data<T>() + s * joints * 12;
  for (int64_t j = 0; j < joints; ++j) {
    const Eigen::Map<const M3<T>> local(args.local.data<T>() + (s * joints + j) * 9);
    Eigen::Map<M34<T>> t(out + 12 * j);
    const int p = args.parents[j];
    if (p < 0) {
      t.template leftCols<3>() = local;
      t.col(3) = Eigen::Map<const V3<T>>(args.root.data<T>() + 3 * s);
      continue;
    }
    const Eigen::Map<const M34<T>> parent(out + 12 * p);
    const V3<T> bone =
        Eigen::Map<const V3<T>>(rest + 3 * j) - Eigen::Map<const V3<T>>(rest + 3 * p);
    t.template leftCols<3>().noalias() = parent.template leftCols<3>() * local;
    t.col(3) = parent.col(3) + parent.template leftCols<3>() * bone;
  }
}

template <class T>
void fk_grad_one(const FkGradArgs& args, int64_t s) {
  const int64_t joints = args.local.size(1);
  const T* rest = args.rest.data<T>() + s * joints * 3;
  const T* transforms = args.transforms.data<T>() + s * joints * 12;
  T* g_rest = args.g_rest.data<T>() + s * joints * 3;
  Scratch<M34<T>> g(static_cast<size_t>(joints));
  Eigen::Map<V3<T>> g_root(args.g_root.data<T>() + 3 * s);
  g_root.setZero();
  for (int64_t j = 0; j < joints; ++j) {
    g[j] = Eigen::Map<const M34<T>>(args.gy.data<T>() + (s * joints + j) * 12);
    Eigen::Map<V3<T>>(g_rest + 3 * j).setZero();
  }
  for (int64_t j = joints - 1; j >= 0; --j) {
    const M34<T>& gj = g[j];
    const Eigen::Map<const M3<T>> local(args.local.data<T>() + (s * joints + j) * 9);
    Eigen::Map<M3<T>> g_local(args.out.data<T>() + (s * joints + j) * 9);
    const int p = args.parents[j];
    if (p < 0) {
      g_local = gj.template leftCols<3>();
      g_root += gj.col(3);  // there may be several roots, or no joint at all
      continue;
    }
    const M3<T> parent = Eigen::Map<const M34<T>>(transforms + 12 * p).template leftCols<3>();
    const V3<T> bone =
        Eigen::Map<const V3<T>>(rest + 3 * j) - Eigen::Map<const V3<T>>(rest + 3 * p);
    M34<T>& gp = g[p];
    g_local = parent.transpose() * gj.template leftCols<3>();
    gp.template leftCols<3>() +=
        gj.template leftCols<3>() * local.transpose() + gj.col(3) * bone.transpose();
    gp.col(3) += gj.col(3);
    const V3<T> g_bone = parent.transpose() * gj.col(3);
    Eigen::Map<V3<T>>(g_rest + 3 * j) += g_bone;
    Eigen::Map<V3<T>>(g_rest + 3 * p) -= g_bone;
  }
}

}  // namespace

void fk(const FkArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    parallel_each(args.local.size(0), 16, [&](int64_t s) { fk_one<decltype(zero)>(args, s); });
  });
}

void fk_grad(const FkGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    parallel_each(args.local.size(0), 16, [&](int64_t s) { fk_grad_one<decltype(zero)>(args, s); });
  });
}

}  // namespace restage::cpu
