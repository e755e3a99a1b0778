// Recomputation: less memory for more time (Chen et al. 2016, "Training deep nets with sublinear
// memory cost").
#pragma once

#include <functional>
#include <span>

#include "nn/module.h"

namespace restage {

/// What a module makes of inputs. It may use parameters of the module and no others, and must
/// do the same each time; what is random comes from the context.
using ModuleForward = std::function<Var(Context&, std::span<const Var>)>;

/// forward(ctx, inputs), of whose inside the tape keeps nothing: the backward pass computes it once
/// more. Value and gradients have the same bits as without. Batch norm's running averages change
/// once. Error if the forward pass binds a parameter that is not the module's: its gradient would
/// be lost.
///
///   Var y = checkpointed(ctx, block, {&x, 1}, [&](Context& c, auto in) { return block(c, in[0]);
///   });
Var checkpointed(Context& ctx, Module& module, std::span<const Var> inputs,
                 const ModuleForward& forward);

}  // namespace restage
