#include "datasets/readers/arrays/pickle_names.h"

#include <string_view>

namespace restage::pickle_detail {
namespace {

struct Named {
  std::string_view name;
  Call call;
};

constexpr Named kNames[] = {
    {"numpy.core.multiarray._reconstruct", Call::reconstruct},
    {"numpy._core.multiarray._reconstruct", Call::reconstruct},
    {"numpy.core.multiarray.scalar", Call::scalar},
    {"numpy._core.multiarray.scalar", Call::scalar},
    {"numpy.core.numeric._frombuffer", Call::frombuffer},
    {"numpy._core.numeric._frombuffer", Call::frombuffer},
    {"numpy.dtype", Call::dtype},
    {"numpy.ndarray", Call::type},
    {"_codecs.encode", Call::encode},
    {"builtins.bytes", Call::bytes},
    {"__builtin__.bytes", Call::bytes},
    {"builtins.bytearray", Call::bytes},
    {"__builtin__.bytearray", Call::bytes},
    {"builtins.list", Call::list},
    {"__builtin__.list", Call::list},
    {"builtins.tuple", Call::list},
    {"__builtin__.tuple", Call::list},
    {"builtins.set", Call::list},
    {"__builtin__.set", Call::list},
    {"builtins.frozenset", Call::list},
    {"__builtin__.frozenset", Call::list},
    {"torch.Size", Call::list},
    {"builtins.dict", Call::map},
    {"__builtin__.dict", Call::map},
    {"collections.OrderedDict", Call::map},
    {"collections.defaultdict", Call::map},
    {"easydict.EasyDict", Call::map},
    {"argparse.Namespace", Call::object},
    {"types.SimpleNamespace", Call::object},
    {"copy_reg._reconstructor", Call::reconstructor},
    {"copyreg._reconstructor", Call::reconstructor},
    {"builtins.object", Call::type},
    {"__builtin__.object", Call::type},
    {"builtins.int", Call::type},
    {"builtins.float", Call::type},
    {"builtins.str", Call::type},
    {"joblib.numpy_pickle.NumpyArrayWrapper", Call::wrapper},
    {"torch._utils._rebuild_tensor", Call::tensor},
    {"torch._utils._rebuild_tensor_v2", Call::tensor},
    {"torch._utils._rebuild_tensor_v3", Call::tensor},
    {"torch._utils._rebuild_parameter", Call::first},
    {"torch._tensor._rebuild_from_type_v2", Call::apply},
    {"torch.Tensor", Call::type},
    {"torch.nn.parameter.Parameter", Call::type},
    {"torch.device", Call::text},
    {"pathlib.PosixPath", Call::text},
    {"pathlib.PurePosixPath", Call::text},
    {"pathlib.WindowsPath", Call::text},
    {"pathlib._local.PosixPath", Call::text},
};

struct TorchType {
  std::string_view storage, type, name;
};

constexpr TorchType kTorchTypes[] = {
    {"torch.FloatStorage", "torch.float32", "<f4"},
    {"torch.DoubleStorage", "torch.float64", "<f8"},
    {"torch.HalfStorage", "torch.float16", "<f2"},
    {"torch.LongStorage", "torch.int64", "<i8"},
    {"torch.IntStorage", "torch.int32", "<i4"},
    {"torch.ShortStorage", "torch.int16", "<i2"},
    {"torch.CharStorage", "torch.int8", "|i1"},
    {"torch.ByteStorage", "torch.uint8", "|u1"},
    {"torch.BoolStorage", "torch.bool", "|b1"},
    {"torch.BFloat16Storage", "torch.bfloat16", "bf2"},
    {"torch.storage.UntypedStorage", "", "|u1"},
};

}  // namespace

Call call_of(const std::string& name) {
  for (const Named& known : kNames)
    if (name == known.name) return known.call;
  for (const TorchType& type : kTorchTypes) {
    if (name == type.storage) return Call::storage;
    if (name == type.type) return Call::type;
  }
  return Call::none;
}

std::string type_of_torch(const std::string& name) {
  for (const TorchType& type : kTorchTypes)
    if (name == type.storage || name == type.type) return std::string(type.name);
  return "";
}

}  // namespace restage::pickle_detail
