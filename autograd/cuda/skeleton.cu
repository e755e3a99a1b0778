// Kinematics, a thread a skeleton: joints follow each other. Skinning, a thread a vertex.
#include "autograd/cuda/kernels.h"
#include "autograd/cuda/sums.h"

namespace restage::cuda {
namespace {

constexpr int kMostJoints = 256;

/// Parents by value, as a launch takes them.
struct Parents {
  int16_t of[kMostJoints];
  explicit Parents(std::span<const int> parents) {
    if (parents.size() > kMostJoints)
      throw Error("kernels of the GPU know skeletons of at most " + std::to_string(kMostJoints) +
                  " joints");
    for (size_t i = 0; i < parents.size(); ++i) of[i] = static_cast<int16_t>(parents[i]);
  }
};

/// Row r of [G | P], columns 0 to 2, times x.
template <class T>
RESTAGE_DEVICE T row_times(const T* t, int r, const T* x) {
  return t[4 * r] * x[0] + t[4 * r + 1] * x[1] + t[4 * r + 2] * x[2];
}
/// Column c of G, transposed, times g's column `of` (of rows of four).
template <class T>
RESTAGE_DEVICE T column_times(const T* t, int c, const T* g, int of) {
  return t[c] * g[of] + t[4 + c] * g[4 + of] + t[8 + c] * g[8 + of];
}

template <class T>
void fk_of(const FkArgs& args) {
  const T *local = at<T>(args.local), *rest = at<T>(args.rest), *root = at<T>(args.root);
  T* out = at<T>(args.out);
  const int64_t joints = args.local.size(1);
  const Parents parents(args.parents);
  each(args.local.size(0), [=] RESTAGE_DEVICE(int64_t s) {
    for (int64_t j = 0; j < joints; ++j) {
      const T* l = local + (s * joints + j) * 9;
      T* t = out + (s * joints + j) * 12;
      const int p = parents.of[j];
      if (p < 0) {
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c) t[4 * r + c] = l[3 * r + c];
          t[4 * r + 3] = root[3 * s + r];
        }
        continue;
      }
      const T *up = out + (s * joints + p) * 12, *a = rest + (s * joints + j) * 3,
              *b = rest + (s * joints + p) * 3;
      const T bone[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
          const T column[3] = {l[c], l[3 + c], l[6 + c]};
          t[4 * r + c] = row_times(up, r, column);
        }
        t[4 * r + 3] = up[4 * r + 3] + row_times(up, r, bone);
      }
    }
  });
}

/// Only the gradients of the joints' transforms follow each other, by rows that do not mix; what is
/// made of them has a thread for each joint.
template <class T>
void fk_grad_of(const FkGradArgs& args) {
  const T *local = at<T>(args.local), *rest = at<T>(args.rest), *world = at<T>(args.transforms);
  T *g_local = at<T>(args.out), *g_rest = at<T>(args.g_rest), *g_root = at<T>(args.g_root);
  Tensor room = args.gy.clone();  // becomes the gradient of each joint's transform
  T* g = at<T>(room);
  const int64_t joints = args.local.size(1), n = args.local.size(0);
  const Parents parents(args.parents);
  each(3 * n, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t s = i / 3, r = i % 3;
    T root = 0;
    for (int64_t j = joints - 1; j >= 0; --j) {
      const T *gj = g + (s * joints + j) * 12 + 4 * r, *l = local + (s * joints + j) * 9;
      const int p = parents.of[j];
      if (p < 0) {
        root += gj[3];
        continue;
      }
      T* gp = g + (s * joints + p) * 12 + 4 * r;
      const T *a = rest + (s * joints + j) * 3, *b = rest + (s * joints + p) * 3;
      for (int c = 0; c < 3; ++c) gp[c] += row_times(gj, 0, l + 3 * c) + gj[3] * (a[c] - b[c]);
      gp[3] += gj[3];
    }
    g_root[i] = root;
  });
  each(n * joints, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t s = i / joints, j = i % joints;
    const int p = parents.of[j];
    const T *gj = g + i * 12, *up = world + (s * joints + (p < 0 ? 0 : p)) * 12;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        g_local[i * 9 + 3 * r + c] = p < 0 ? gj[4 * r + c] : column_times(up, r, gj, c);
    for (int r = 0; r < 3; ++r) {
      T total = p < 0 ? T(0) : column_times(up, r, gj, 3);
      for (int64_t child = j + 1; child < joints; ++child)
        if (parents.of[child] == j)
          total -= column_times(world + i * 12, r, g + (s * joints + child) * 12, 3);
      g_rest[3 * i + r] = total;
    }
  });
}

/// The rows [G | b] of all joints blended for vertex k, b = P - G rest.
template <class T>
RESTAGE_DEVICE void blended(const T* weights, const T* transforms, const T* rest, int64_t joints,
                            T* out) {
  for (int e = 0; e < 12; ++e) out[e] = 0;
  for (int64_t j = 0; j < joints; ++j)
    for (int r = 0; r < 3; ++r) {
      const T* t = transforms + 12 * j;
      for (int c = 0; c < 3; ++c) out[4 * r + c] += weights[j] * t[4 * r + c];
      out[4 * r + 3] += weights[j] * (t[4 * r + 3] - row_times(t, r, rest + 3 * j));
    }
}

template <class T>
void lbs_of(const LbsArgs& args) {
  const T *points = at<T>(args.points), *weights = at<T>(args.weights),
          *transforms = at<T>(args.transforms), *rest = at<T>(args.rest);
  T* out = at<T>(args.out);
  const int64_t v = args.points.size(1), joints = args.transforms.size(1);
  each(args.points.size(0) * v, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t s = k / v;
    T t[12];
    blended(weights + k * joints, transforms + s * joints * 12, rest + s * joints * 3, joints, t);
    for (int r = 0; r < 3; ++r) out[3 * k + r] = row_times(t, r, points + 3 * k) + t[4 * r + 3];
  });
}

template <class T>
void lbs_grad_of(const LbsGradArgs& args) {
  const T *points = at<T>(args.points), *weights = at<T>(args.weights),
          *transforms = at<T>(args.transforms), *rest = at<T>(args.rest), *gy = at<T>(args.gy);
  T *g_points = at<T>(args.out), *g_weights = at<T>(args.g_weights),
    *g_transforms = at<T>(args.g_transforms), *g_rest = at<T>(args.g_rest);
  const int64_t n = args.points.size(0), v = args.points.size(1), joints = args.transforms.size(1);
  each(n * v, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t s = k / v;
    const T *x = points + 3 * k, *g = gy + 3 * k, *of = transforms + s * joints * 12,
            *at_rest = rest + s * joints * 3;
    T t[12];
    blended(weights + k * joints, of, at_rest, joints, t);
    for (int c = 0; c < 3; ++c)
      g_points[3 * k + c] = t[c] * g[0] + t[4 + c] * g[1] + t[8 + c] * g[2];
    for (int64_t j = 0; j < joints; ++j) {
      const T from_joint[3] = {x[0] - at_rest[3 * j], x[1] - at_rest[3 * j + 1],
                               x[2] - at_rest[3 * j + 2]};
      T total = 0;
      for (int r = 0; r < 3; ++r)
        total += g[r] * (row_times(of + 12 * j, r, from_joint) + of[12 * j + 4 * r + 3]);
      g_weights[k * joints + j] = total;
    }
  });
  Tensor room = scratch(args.out, n * joints * 12);
  double* total = at<double>(room);
  sums(args.out, n, v, joints * 12, total, [=] RESTAGE_DEVICE(int64_t s, int64_t i, int64_t e) {
    const int64_t k = s * v + i, j = e / 12, r = e % 12 / 4, c = e % 4;
    const double g = static_cast<double>(weights[k * joints + j] * gy[3 * k + r]);
    return c == 3 ? g : g * static_cast<double>(points[3 * k + c] - rest[(s * joints + j) * 3 + c]);
  });
  each(n * joints, [=] RESTAGE_DEVICE(int64_t k) {
    const T* t = transforms + 12 * k;
    for (int e = 0; e < 12; ++e) g_transforms[12 * k + e] = static_cast<T>(total[12 * k + e]);
    const T g[3] = {g_transforms[12 * k + 3], g_transforms[12 * k + 7], g_transforms[12 * k + 11]};
    for (int c = 0; c < 3; ++c)
      g_rest[3 * k + c] = -(t[c] * g[0] + t[4 + c] * g[1] + t[8 + c] * g[2]);
  });
}

}  // namespace

void fk(const FkArgs& args) { RESTAGE_FLOATS(args.out.dtype(), fk_of, args) }
void fk_grad(const FkGradArgs& args) { RESTAGE_FLOATS(args.out.dtype(), fk_grad_of, args) }
void lbs(const LbsArgs& args) { RESTAGE_FLOATS(args.out.dtype(), lbs_of, args) }
void lbs_grad(const LbsGradArgs& args) { RESTAGE_FLOATS(args.out.dtype(), lbs_grad_of, args) }

}  // namespace restage::cuda
