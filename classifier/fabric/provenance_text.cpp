#include "classifier/fabric/provenance_text.hpp"

#include <functional>
#include <iterator>

namespace weft::classifier {
namespace {

constexpr std::array<std::string_view, 3> bench_names{"unknown", "simulated", "real"};
constexpr std::size_t most_labels = 10'000;

}  // namespace

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
    in.refuse("labels are not in order", "one after " + *late, *std::next(late));
  return labels;
}

}  // namespace weft::classifier
