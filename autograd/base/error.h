// Errors. A library function throws; only the command line (experiments/cli) prints and exits.
#pragma once

#include <stdexcept>
#include <string>

namespace restage {

/// Base of all errors of this project; `exit_code` is what the command line returns for it.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& what, int code = 1)
      : std::runtime_error(what), exit_code(code) {}
  int exit_code;
};

/// The user's input or usage is at fault: exit code 2 and one line
/// `restage: <where>: <what is wrong>; <how to mend it>` (docs: command-line contract).
class InputError : public Error {
 public:
  /// `where` is a file or `file:line`, or empty when no file is involved.
  InputError(const std::string& where, const std::string& wrong, const std::string& fix)
      : Error((where.empty() ? "" : where + ": ") + wrong + "; " + fix, 2) {}
};

/// The work itself failed (training diverged, disk full, verification found differences): code 1.
class WorkError : public Error {
 public:
  explicit WorkError(const std::string& what) : Error(what, 1) {}
};

/// Shapes or dtypes that do not fit an op. Names op, dimension letters, both shapes, module path.
class ShapeError : public Error {
 public:
  explicit ShapeError(const std::string& what) : Error(what, 1) {}
};

/// A value became infinite or NaN. Names op and module path.
class NonFiniteError : public Error {
 public:
  explicit NonFiniteError(const std::string& what) : Error(what, 1) {}
};

}  // namespace restage
