// The training steps of NPT, LART and 3D-CoreNet that are timed: what restage_bench writes for
// both programs, and what it does with it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "datasets/sampling/transfers.h"
#include "nn/models/transfer.h"

namespace restage::bench {

struct TransferCase {
  std::string name;   ///< of the item, of its weights and before the names of its batch
  std::string model;  ///< in the registry
  std::vector<std::string> sizes;
  int64_t batch, vertices;
  int64_t metric_points = 0;  ///< of LART's metric loss
};

/// By model, each as in configs/MODEL/lite.yaml, then with the paper's widths.
const std::vector<TransferCase>& transfer_cases();

/// As it starts. LART's attentions are open a little: with their gamma of 0 some of the gradients
/// would be zeros.
std::shared_ptr<TransferModel> transfer_model(const TransferCase& c);

/// The batch that its stage would draw.
TransferBatch transfer_batch(const Corpus& corpus, const TransferCase& c, int64_t frames);

}  // namespace restage::bench
