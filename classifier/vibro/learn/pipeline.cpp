#include "classifier/vibro/learn/pipeline.hpp"

#include <algorithm>
#include <string>

#include "classifier/fabric/model_text.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier::vibro {

std::vector<double> Pipeline::prepared(std::span<const double> features) const {
  std::vector<double> z(features.size());
  for (std::size_t f = 0; f < z.size(); ++f) z[f] = scaler_.apply(f, features[f]);
  if (axes_.rows() == 0) return z;
  std::vector<double> out(axes_.rows(), 0.0);
  for (std::size_t k = 0; k < out.size(); ++k)
    for (std::size_t f = 0; f < z.size(); ++f) out[k] += axes_(k, f) * z[f];
  return out;
}

Result<Pipeline> Pipeline::train(const Training& training, const PipelineOptions& options) {
  if (auto ok = unless_stopped(options.stop); !ok) return pass(ok.error());
  const std::span<const double> values(training.rows->data());
  Pipeline out;
  // Rows that fit() refuses must not be scaled before it has seen them.
  if (training.rows->rows() == 0 || first_not_finite(values) < values.size()) {
    auto refused = fit(options.method, training, options.learner);
    if (!refused) return pass(refused.error());
  }
  out.scaler_ = fit_scaler(*training.rows);
  if (options.components > 0) {
    PcaBasis basis = pca_basis(scaled(out.scaler_, *training.rows), options.components);
    out.axes_ = std::move(basis.axes);
    out.explained_ = basis.explained.back();
  }
  Matrix rows;
  rows.assign(training.rows->rows(),
              out.axes_.rows() == 0 ? training.rows->cols() : out.axes_.rows());
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const auto own = out.prepared(training.rows->row(r));
    std::copy(own.begin(), own.end(), rows.row(r).begin());
  }
  auto made = fit(options.method, {&rows, training.of_row, training.classes, training.unit},
                  options.learner);
  if (!made) return pass(made.error());
  out.classifier_ = std::move(*made);
  return out;
}

void Pipeline::write(LineWriter& out) const {
  write_scaler(out, scaler_);
  write_matrix(out, "axes", axes_);
  out.number("explained", explained_);
  classifier_->write(out);
}

std::optional<Pipeline> Pipeline::read(LineReader& in, Method method, std::size_t features,
                                       std::size_t classes) {
  Pipeline out;
  out.scaler_ = read_scaler(in, features);
  out.axes_ = read_matrix(in, "axes", features);
  out.explained_ = in.not_negative("explained");
  const std::size_t columns = out.axes_.rows() == 0 ? features : out.axes_.rows();
  if (in.ok()) out.classifier_ = read_classifier(method, in, columns, classes);
  if (!in.ok() || out.classifier_ == nullptr) return std::nullopt;
  return out;
}

Result<std::size_t> Pipeline::classify(std::span<const double> features) const {
  if (auto ok = check_length(features, scaler_.mean.size(), "classify"); !ok)
    return pass(ok.error());
  if (const std::size_t bad = first_not_finite(features); bad < features.size())
    return not_finite("feature " + std::to_string(bad), "feature", features[bad]);
  return classifier_->classify(prepared(features));
}

}  // namespace weft::classifier::vibro
