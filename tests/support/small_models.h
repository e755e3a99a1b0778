// Untrained networks, small where they can be.
#pragma once

#include "nn/weights/bundle.h"

namespace restage::testing {

inline constexpr const char* kSmallExtractor = "skeleton/patch_transformer";

/// A model with some sizes changed, untrained.
inline TrainedModel untrained_model(const std::string& name, const std::vector<std::string>& sizes,
                                    const Init& init, Settings settings = {}) {
  const AnyConfig config = model_config(name, sizes);
  return {name, config, make_model(name, config, init), std::move(settings)};
}

/// Every role that retargeting needs, and offsets.
inline Bundle untrained_bundle(const std::string& motion = "smrm/rot6d",
                               std::vector<std::string> motion_sizes = {"hidden=32"},
                               int extractor_layers = 1) {
  const Init init{RngKey{5, 0}, DType::f32};
  Bundle out;
  const auto put = [&](const std::string& name, const std::vector<std::string>& sizes) {
    out.put(model_type(name).role, untrained_model(name, sizes, init.sub(name)));
  };
  put(motion, motion_sizes);
  put("deformation/weights", {});
  put("deformation/offsets", {});
  put(kSmallExtractor, {"points=64", "width=16", "layers=" + std::to_string(extractor_layers),
                        "centres=16", "neighbours=4"});
  return out;
}

/// The bundle with one setting of a role changed.
inline Bundle with_setting(Bundle bundle, const std::string& role, const std::string& name,
                           const std::string& value) {
  TrainedModel model = bundle.need(role, "test");
  model.settings[name] = value;
  bundle.put(role, std::move(model));
  return bundle;
}

}  // namespace restage::testing
