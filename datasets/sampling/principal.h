// Principal components of rows of numbers.
#pragma once

#include <Eigen/Core>

namespace restage {

struct Principal {
  Eigen::VectorXd mean;        ///< [d]
  Eigen::MatrixXd components;  ///< [k, d]: of length 1, at right angles, the largest first
  Eigen::VectorXd deviations;  ///< [k]: standard deviation of the rows along each
};

/// The first `most` components of rows [n, d], or as many as the rows have: a direction along which
/// they hardly differ (a millionth of the first's deviation) is none, and there are at most n - 1.
/// At the largest of its numbers a component is positive. A function of the rows to the last bit,
/// whatever the number of threads. The rows are used up.
Principal principal_components(Eigen::MatrixXd rows, Eigen::Index most);

}  // namespace restage
