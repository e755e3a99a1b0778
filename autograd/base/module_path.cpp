#include "autograd/base/module_path.h"

namespace restage {
namespace {

thread_local std::string current_path;
thread_local const char* current_op = nullptr;

}  // namespace

ModuleScope::ModuleScope(const std::string& name) : previous_(current_path.size()) {
  if (name.empty()) return;
  if (!current_path.empty()) current_path += '.';
  current_path += name;
}

ModuleScope::~ModuleScope() { current_path.resize(previous_); }

OpScope::OpScope(const char* name) : previous_(current_op) { current_op = name; }
OpScope::~OpScope() { current_op = previous_; }

std::string module_path() { return current_path.empty() ? "(no module)" : current_path; }

std::string running_op() {
  return (current_op != nullptr ? "'" + std::string(current_op) + "' in " : "") + module_path();
}

}  // namespace restage
