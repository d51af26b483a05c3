#include "classifier/selection/pca.hpp"

#include <Eigen/Dense>
#include <algorithm>

namespace weft::classifier {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using View = Eigen::Map<const RowMajor>;

// Squares of the singular values, falling, and the right singular vectors as columns.
struct Spectrum {
  Eigen::VectorXd square;
  Eigen::MatrixXd right;
};

// Through the smaller of Z Z' and Z' Z: with 16 trials of 195 features the 16 x 16 one costs almost
// nothing.
Spectrum decompose(const View& z) {
  const bool wide = z.cols() > z.rows();
  const Eigen::MatrixXd gram = wide ? Eigen::MatrixXd(z * z.transpose()) : z.transpose() * z;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  Spectrum out;
  out.square = solver.eigenvalues().reverse().cwiseMax(0.0);
  const Eigen::MatrixXd vectors = solver.eigenvectors().rowwise().reverse();
  out.right = wide ? Eigen::MatrixXd(z.transpose() * vectors) : vectors;
  return out;
}

void store_axis(const Eigen::VectorXd& direction, Matrix& axes, std::size_t row) {
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  const double sign = direction(largest) < 0.0 ? -1.0 : 1.0;
  const Eigen::VectorXd unit = direction.normalized() * sign;
  std::copy(unit.data(), unit.data() + unit.size(), axes.row(row).begin());
}

}  // namespace

PcaBasis pca_basis(const Matrix& rows, std::size_t cap) {
  const View z(rows.data().data(), static_cast<Eigen::Index>(rows.rows()),
               static_cast<Eigen::Index>(rows.cols()));
  const Spectrum s = decompose(z);
  const double total = s.square.sum();
  if (!(total > 0.0)) return {Matrix(1, rows.cols()), {1.0}};
  std::size_t retained = 0;
  const std::size_t most = std::min(cap, static_cast<std::size_t>(s.square.size()));
  while (retained < most && s.square(static_cast<Eigen::Index>(retained)) > 1e-14 * s.square(0))
    ++retained;
  PcaBasis out{Matrix(retained, rows.cols()), {}};
  double sum = 0.0;
  for (std::size_t k = 0; k < retained; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    store_axis(s.right.col(at), out.axes, k);
    sum += s.square(at);
    out.explained.push_back(sum / total);
  }
  return out;
}

std::size_t components_for(const PcaBasis& basis, double share) {
  const auto enough =
      std::lower_bound(basis.explained.begin(), basis.explained.end(), share - 1e-12);
  const auto count = static_cast<std::size_t>(enough - basis.explained.begin()) + 1;
  return std::min(count, basis.explained.size());
}

}  // namespace weft::classifier
