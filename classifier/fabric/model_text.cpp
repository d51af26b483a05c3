#include "classifier/fabric/model_text.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>

namespace weft::classifier {
namespace {

void write_info(LineWriter& out, const CoreInfo& info) {
  out.number("threshold", info.threshold);
  out.number("C", info.c);
  out.number("gamma", info.gamma);
  out.number("cv_loss", info.cv_loss);
  const std::array counts{info.cv_errors, info.train_rows, info.fits, info.folds};
  out.counts("cv_errors,train_rows,fits,folds", counts);
  out.count("selected", info.selected.size());
  for (const SelectedFeature& f : info.selected) {
    out.count("column", f.column);
    out.numbers("t,p,log_p", std::array{f.t, f.p_value, f.log_p});
  }
}

std::vector<SelectedFeature> read_selected(LineReader& in, std::size_t features) {
  std::vector<SelectedFeature> out;
  const std::size_t count = in.count("selected", 0, features);
  for (std::size_t i = 0; in.ok() && i < count; ++i) {
    const std::size_t column = in.count("column", 0, features - 1);
    const std::vector<double> values = in.numbers("t,p,log_p", 3, true);
    if (in.ok()) out.push_back({column, values[0], values[1], values[2]});
  }
  return out;
}

CoreInfo read_info(LineReader& in, std::size_t features) {
  CoreInfo info;
  info.threshold = in.number("threshold");
  info.c = in.number("C");
  info.gamma = in.positive("gamma");
  info.cv_loss = in.number("cv_loss");
  const std::vector<std::size_t> counts = in.counts("cv_errors,train_rows,fits,folds", 4);
  if (in.ok()) {
    info.cv_errors = counts[0];
    info.train_rows = counts[1];
    info.fits = counts[2];
    info.folds = counts[3];
  }
  info.selected = read_selected(in, features);
  return info;
}

Reducer read_reducer(LineReader& in, std::size_t features) {
  const std::size_t inputs = in.count("inputs", 1, features);
  std::vector<std::size_t> columns = in.counts("columns", inputs);
  in.within(columns, features, "feature");
  Scaler scaler = read_scaler(in, inputs);
  Matrix axes = read_matrix(in, "axes", inputs);
  return {std::move(columns), std::move(scaler), std::move(axes)};
}

constexpr std::size_t most_rows = 100'000'000;

constexpr std::array<std::string_view, 3> bench_names{"unknown", "simulated", "real"};
constexpr std::size_t most_labels = 10'000;

}  // namespace

std::string core_text(const FabricCore& core) {
  LineWriter out;
  write_info(out, core.info());
  const Reducer& reducer = core.reducer();
  out.count("inputs", reducer.columns().size());
  out.counts("columns", reducer.columns());
  write_scaler(out, reducer.scaler());
  write_matrix(out, "axes", reducer.axes());
  write_matrix(out, "support_vectors", core.support());
  out.numbers("coefficients", core.coefficient());
  out.number("bias", core.bias());
  return out.str();
}

FabricCore read_core(LineReader& in, std::size_t features) {
  CoreInfo info = read_info(in, features);
  Reducer reducer = read_reducer(in, features);
  info.inputs = reducer.directions();
  Matrix support = read_matrix(in, "support_vectors", info.inputs);
  std::vector<double> coefficient = in.numbers("coefficients", support.rows());
  const double bias = in.number("bias");
  return {std::move(info), std::move(reducer), std::move(support), std::move(coefficient), bias};
}

Result<FabricCore> core_from_text(std::string_view text, std::size_t features) {
  LineReader in(text);
  FabricCore core = read_core(in, features);
  in.finish();
  if (!in.ok()) return pass(in.status().error());
  return core;
}

void write_rows(LineWriter& out, std::string_view keyword, const Matrix& matrix) {
  for (std::size_t r = 0; r < matrix.rows(); ++r) out.numbers(keyword, matrix.row(r));
}

Matrix read_rows(LineReader& in, std::string_view keyword, std::size_t rows, std::size_t cols) {
  std::vector<std::vector<double>> read;
  for (std::size_t r = 0; in.ok() && r < rows; ++r) read.push_back(in.numbers(keyword, cols));
  if (!in.ok() || rows == 0) return {};
  Matrix out(rows, cols);
  for (std::size_t r = 0; r < rows; ++r)
    std::copy(read[r].begin(), read[r].end(), out.row(r).begin());
  return out;
}

void write_matrix(LineWriter& out, std::string_view keyword, const Matrix& matrix) {
  out.count(keyword, matrix.rows());
  write_rows(out, "row", matrix);
}

Matrix read_matrix(LineReader& in, std::string_view keyword, std::size_t cols) {
  return read_rows(in, "row", in.count(keyword, 0, most_rows), cols);
}

void write_scaler(LineWriter& out, const Scaler& scaler) {
  out.numbers("mean", scaler.mean);
  out.numbers("deviation", scaler.deviation);
}

Scaler read_scaler(LineReader& in, std::size_t columns) {
  Scaler scaler;
  scaler.mean = in.numbers("mean", columns);
  scaler.deviation = in.positives("deviation", columns);
  return scaler;
}

void write_provenance(LineWriter& out, const Provenance& provenance) {
  out.text("bench", provenance.bench);
  out.text("dataset_sha256", provenance.dataset_sha256);
  out.text("software", provenance.software_version);
  out.text("training", provenance.training);
}

Provenance read_provenance(LineReader& in) {
  Provenance provenance;
  provenance.bench = bench_names[word(in, "bench", bench_names)];
  provenance.dataset_sha256 = in.text("dataset_sha256");
  provenance.software_version = in.text("software");
  provenance.training = in.text("training");
  return provenance;
}

std::vector<std::string> read_names(LineReader& in, std::string_view keyword, std::size_t count) {
  std::vector<std::string> out;
  for (std::size_t i = 0; in.ok() && i < count; ++i) out.push_back(in.text(keyword));
  return out;
}

void write_labels(LineWriter& out, const std::vector<std::string>& labels) {
  out.count("labels", labels.size());
  for (const std::string& label : labels) out.text("label", label);
}

std::vector<std::string> read_labels(LineReader& in) {
  std::vector<std::string> labels = read_names(in, "label", in.count("labels", 2, most_labels));
  const auto late = std::adjacent_find(labels.begin(), labels.end(), std::greater_equal<>());
  if (late != labels.end())
    in.refuse("labels not in order", "a label after " + *late, *std::next(late));
  return labels;
}

}  // namespace weft::classifier
