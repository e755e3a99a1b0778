// Forward kinematics and linear blend skinning (spec 3.5, 5.2).
#include <vector>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"

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
    const int p = args.parents[static_cast<size_t>(j)];
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
  std::vector<M34<T>> g(static_cast<size_t>(joints));
  Eigen::Map<V3<T>> g_root(args.g_root.data<T>() + 3 * s);
  g_root.setZero();
  for (int64_t j = 0; j < joints; ++j) {
    g[static_cast<size_t>(j)] = Eigen::Map<const M34<T>>(args.gy.data<T>() + (s * joints + j) * 12);
    Eigen::Map<V3<T>>(g_rest + 3 * j).setZero();
  }
  for (int64_t j = joints - 1; j >= 0; --j) {
    const M34<T>& gj = g[static_cast<size_t>(j)];
    const Eigen::Map<const M3<T>> local(args.local.data<T>() + (s * joints + j) * 9);
    Eigen::Map<M3<T>> g_local(args.out.data<T>() + (s * joints + j) * 9);
    const int p = args.parents[static_cast<size_t>(j)];
    if (p < 0) {
      g_local = gj.template leftCols<3>();
      g_root += gj.col(3);  // there may be several roots, or no joint at all
      continue;
    }
    const M3<T> parent = Eigen::Map<const M34<T>>(transforms + 12 * p).template leftCols<3>();
    const V3<T> bone =
        Eigen::Map<const V3<T>>(rest + 3 * j) - Eigen::Map<const V3<T>>(rest + 3 * p);
    M34<T>& gp = g[static_cast<size_t>(p)];
    g_local = parent.transpose() * gj.template leftCols<3>();
    gp.template leftCols<3>() +=
        gj.template leftCols<3>() * local.transpose() + gj.col(3) * bone.transpose();
    gp.col(3) += gj.col(3);
    const V3<T> g_bone = parent.transpose() * gj.col(3);
    Eigen::Map<V3<T>>(g_rest + 3 * j) += g_bone;
    Eigen::Map<V3<T>>(g_rest + 3 * p) -= g_bone;
  }
}

/// y = sum_j W_j (G_j x + b_j) with b_j = P_j - G_j rest_j, per sample.
template <class T>
std::vector<M34<T>> skinning_transforms(const Tensor& transforms, const Tensor& rest, int64_t s) {
  const int64_t joints = transforms.size(1);
  std::vector<M34<T>> out(static_cast<size_t>(joints));
  for (int64_t j = 0; j < joints; ++j) {
    M34<T>& t = out[static_cast<size_t>(j)];
    t = Eigen::Map<const M34<T>>(transforms.data<T>() + (s * joints + j) * 12);
    t.col(3) -=
        t.template leftCols<3>() * Eigen::Map<const V3<T>>(rest.data<T>() + (s * joints + j) * 3);
  }
  return out;
}

template <class T>
void lbs_one(const LbsArgs& args, int64_t s) {
  const int64_t v = args.points.size(1), joints = args.transforms.size(1);
  const auto t = skinning_transforms<T>(args.transforms, args.rest, s);
  for (int64_t i = s * v; i < (s + 1) * v; ++i) {
    const T* w = args.weights.data<T>() + i * joints;
    M34<T> blend = M34<T>::Zero();
    for (int64_t j = 0; j < joints; ++j) blend += w[j] * t[static_cast<size_t>(j)];
    const Eigen::Map<const V3<T>> x(args.points.data<T>() + 3 * i);
    Eigen::Map<V3<T>>(args.out.data<T>() + 3 * i) = blend.template leftCols<3>() * x + blend.col(3);
  }
}

template <class T>
void lbs_grad_one(const LbsGradArgs& args, int64_t s) {
  const int64_t v = args.points.size(1), joints = args.transforms.size(1);
  const auto t = skinning_transforms<T>(args.transforms, args.rest, s);
  std::vector<M34<T>> gt(static_cast<size_t>(joints), M34<T>::Zero());
  for (int64_t i = s * v; i < (s + 1) * v; ++i) {
    const T* w = args.weights.data<T>() + i * joints;
    T* gw = args.g_weights.data<T>() + i * joints;
    const V3<T> x = Eigen::Map<const V3<T>>(args.points.data<T>() + 3 * i);
    const V3<T> g = Eigen::Map<const V3<T>>(args.gy.data<T>() + 3 * i);
    M34<T> outer;  // gradient of the blended transform
    outer.template leftCols<3>() = g * x.transpose();
    outer.col(3) = g;
    M3<T> blend = M3<T>::Zero();
    for (int64_t j = 0; j < joints; ++j) {
      const M34<T>& tj = t[static_cast<size_t>(j)];
      gw[j] = tj.cwiseProduct(outer).sum();
      gt[static_cast<size_t>(j)] += w[j] * outer;
      blend += w[j] * tj.template leftCols<3>();
    }
    Eigen::Map<V3<T>>(args.out.data<T>() + 3 * i) = blend.transpose() * g;
  }
  for (int64_t j = 0; j < joints; ++j) {
    const int64_t at = s * joints + j;
    const M3<T> rotation =
        Eigen::Map<const M34<T>>(args.transforms.data<T>() + 12 * at).template leftCols<3>();
    const V3<T> rest = Eigen::Map<const V3<T>>(args.rest.data<T>() + 3 * at);
    M34<T> g = gt[static_cast<size_t>(j)];
    g.template leftCols<3>() -= g.col(3) * rest.transpose();
    Eigen::Map<M34<T>>(args.g_transforms.data<T>() + 12 * at) = g;
    Eigen::Map<V3<T>>(args.g_rest.data<T>() + 3 * at) = -rotation.transpose() * g.col(3);
  }
}

/// Runs f(s) for every sample in parallel.
template <class F>
void for_samples(int64_t n, int64_t grain, F&& f) {
  parallel_for(n, grain, [&](int64_t from, int64_t to) {
    for (int64_t s = from; s < to; ++s) f(s);
  });
}

}  // namespace

void fk(const FkArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    for_samples(args.local.size(0), 16, [&](int64_t s) { fk_one<decltype(zero)>(args, s); });
  });
}

void fk_grad(const FkGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    for_samples(args.local.size(0), 16, [&](int64_t s) { fk_grad_one<decltype(zero)>(args, s); });
  });
}

void lbs(const LbsArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    for_samples(args.points.size(0), 1, [&](int64_t s) { lbs_one<decltype(zero)>(args, s); });
  });
}

void lbs_grad(const LbsGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    for_samples(args.points.size(0), 1, [&](int64_t s) { lbs_grad_one<decltype(zero)>(args, s); });
  });
}

}  // namespace restage::cpu
