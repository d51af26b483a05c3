#include "classifier/imprint/imprint_set.hpp"

#include <algorithm>
#include <optional>

#include "classifier/base/parallel.hpp"

namespace weft::classifier::imprint {

Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const FeaturePlan& plan,
                                   std::size_t threads) {
  const auto features = PlannedFeatures::make(plan);
  if (!features) return pass(features.error());
  if (imprints.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "imprints",
                 .what = "no imprint",
                 .expected = "one or more"});
  FeatureMatrix out;
  out.names = features->names();
  out.values.assign(imprints.size(), out.names.size());
  std::vector<std::optional<Error>> problems(imprints.size());
  parallel_workers(imprints.size(), threads, [&] {
    return [&, own = *features](std::size_t i) mutable {
      const auto row = own.extract(imprints[i].image);
      if (row)
        std::copy(row->begin(), row->end(), out.values.row(i).begin());
      else
        problems[i] = row.error();
    };
  });
  for (std::size_t i = 0; i < imprints.size(); ++i) {
    if (problems[i]) return pass(*problems[i], imprints[i].file);
    out.labels.push_back(imprints[i].label);
    out.groups.push_back(imprints[i].object);
    out.files.push_back(imprints[i].file);
  }
  if (auto ok = classifier::check(out); !ok) return pass(ok.error());
  return out;
}

Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const ScaleOptions& options,
                                   std::size_t threads) {
  return build_matrix(imprints, FeaturePlan{options, {}}, threads);
}

Classes find_classes(std::span<const std::string> labels) {
  Classes out;
  for (const std::string& label : labels) {
    const auto at = std::find(out.names.begin(), out.names.end(), label);
    out.of_row.push_back(static_cast<std::size_t>(at - out.names.begin()));
    if (at == out.names.end()) out.names.push_back(label);
  }
  return out;
}

FeatureMatrix select_columns(const FeatureMatrix& matrix, std::span<const std::size_t> columns) {
  FeatureMatrix out{
      {}, Matrix(matrix.size(), columns.size()), matrix.labels, matrix.groups, matrix.files};
  for (std::size_t k = 0; k < columns.size(); ++k) {
    out.names.push_back(matrix.names[columns[k]]);
    for (std::size_t r = 0; r < matrix.size(); ++r) out.values(r, k) = matrix.values(r, columns[k]);
  }
  return out;
}

}  // namespace weft::classifier::imprint
