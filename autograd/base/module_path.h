// Where in the model the program is, for error messages only: "smrm.enc". Kept per thread.
#pragma once

#include <string>

namespace restage {

/// Enters a named part of a model for the lifetime of the object.
class ModuleScope {
 public:
  explicit ModuleScope(const std::string& name);
  ~ModuleScope();
  ModuleScope(const ModuleScope&) = delete;
  ModuleScope& operator=(const ModuleScope&) = delete;

 private:
  size_t previous_;
};

/// Enters an op, forwards or backwards.
class OpScope {
 public:
  explicit OpScope(const char* name);
  ~OpScope();
  OpScope(const OpScope&) = delete;
  OpScope& operator=(const OpScope&) = delete;

 private:
  const char* previous_;
};

/// Path of the innermost scope, "(no module)" outside of all.
std::string module_path();
/// The op that runs, if there is one, and module_path(): "'gather' in smrm.enc".
std::string running_op();

}  // namespace restage
