#include <algorithm>
#include <array>
#include <charconv>
#include <map>

#include "classifier/features/trial.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/storage/dataset/import.hpp"

namespace weft::daemon {
namespace {

/// RFC 4180: quotes where the text would break the line apart.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

/// As printf's %.17g, which gives back the same double, but whatever the locale.
void append_number(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                          std::chars_format::general, 17);
  WEFT_ASSERT(error == std::errc());
  text.append(digits.data(), end);
}

}  // namespace

FactorColumns factor_columns(const Dataset& dataset, const classifier::FeatureMatrix& features) {
  if (dataset.info.factors.empty()) return {};
  std::map<std::string_view, const std::vector<double>*> of_file;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    of_file[dataset.trials[i].file] = &dataset.records[i].spec.factors;
  FactorColumns out{dataset.info.factors, {}};
  for (const std::string& file : features.files) {
    auto found = of_file.find(file);
    if (found == of_file.end()) found = of_file.find(classifier::recording_of(file));
    if (found == of_file.end()) return {};
    out.values.push_back(*found->second);
  }
  return out;
}

Status export_features_csv(const std::filesystem::path& path,
                           const classifier::FeatureMatrix& features,
                           const FactorColumns& factors) {
  if (auto fine = classifier::check(features); !fine)
    return pass(std::move(fine).error(), path.string());
  std::string text = "file,label,group";
  for (const std::string& name : factors.names) text += "," + quoted(name);
  for (const std::string& name : features.names) text += "," + quoted(name);
  text += '\n';
  for (std::size_t i = 0; i < features.size(); ++i) {
    text += quoted(features.files[i]) + "," + quoted(features.labels[i]) + "," +
            quoted(features.groups[i]);
    const auto add = [&text](double value) {
      text += ',';
      append_number(text, value);
    };
    if (!factors.names.empty()) std::ranges::for_each(factors.values[i], add);
    std::ranges::for_each(features.values.row(i), add);
    text += '\n';
  }
  return write_text_file(path, text);
}

}  // namespace weft::daemon
