#include "classifier/fabric/model_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <istream>
#include <iterator>
#include <optional>
#include <ostream>
#include <string_view>

#include "classifier/fabric/line_text.hpp"
#include "classifier/vote/aids_text.hpp"
#include "protocols/base/crc.hpp"

namespace weft::classifier {
namespace {

constexpr std::string_view header_word = "weft-fabric-model ";
constexpr std::string_view crc_word = "crc32 ";
constexpr std::size_t crc_line_bytes = 6 + 8 + 1;
constexpr std::size_t most_labels = 10'000;
constexpr std::size_t most_taxels = 100'000;
constexpr std::size_t most_rows = 100'000'000;

// Words of the options, in the order of their enumerators.
constexpr std::array<std::string_view, 2> skew_words{"peaks", "signal"};
constexpr std::array<std::string_view, 2> norm_words{"l2", "rms"};
constexpr std::array<std::string_view, 2> spectrum_words{"amplitude", "magnitude"};
constexpr std::array<std::string_view, 3> reduction_words{"pvalue", "pca", "all"};
constexpr std::array<std::string_view, 3> bench_words{"unknown", "simulated", "real"};

template <std::size_t n>
std::size_t word(LineReader& in, std::string_view keyword,
                 const std::array<std::string_view, n>& words) {
  const std::string text = in.text(keyword);
  const auto found = std::find(words.begin(), words.end(), text);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  in.refuse("unknown " + std::string(keyword), std::string(words.front()), text);
  return 0;
}

template <std::size_t n, class Enum>
std::string_view word_of(const std::array<std::string_view, n>& words, Enum value) {
  return words[static_cast<std::size_t>(value)];
}

std::uint32_t crc_of(std::string_view text) {
  return crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::string phase_letters(PhaseSet phases) {
  std::string out;
  if (phases.rest) out += to_char(Phase::rest);
  if (phases.press) out += to_char(Phase::press);
  out += to_char(Phase::motion);
  if (phases.end) out += to_char(Phase::end);
  return out;
}

// ---- writing ----

void write_setup(LineWriter& out, const FeatureSetup& setup) {
  out.count("taxels", setup.taxels);
  out.text("phases", phase_letters(setup.phases));
  out.text("skew", word_of(skew_words, setup.options.skew));
  out.text("norm", word_of(norm_words, setup.options.norm));
  out.text("spectrum", word_of(spectrum_words, setup.options.spectrum));
  out.number("mode_bin_counts", setup.options.mode_bin_counts);
  out.number("window_s", setup.window_s);
  out.number("window_step_s", setup.window_step_s);
  out.number("sample_period_s", setup.sample_period_s);
  out.text("exploration", setup.exploration);
}

void write_provenance(LineWriter& out, const Provenance& provenance) {
  out.text("bench", provenance.bench);
  out.text("dataset_sha256", provenance.dataset_sha256);
  out.text("software", provenance.software_version);
  out.text("training", provenance.training);
}

void write_matrix(LineWriter& out, std::string_view keyword, const Matrix& matrix) {
  out.count(keyword, matrix.rows());
  for (std::size_t r = 0; r < matrix.rows(); ++r) out.numbers("row", matrix.row(r));
}

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

void write_core(LineWriter& out, const FabricCore& core) {
  write_info(out, core.info());
  const Reducer& reducer = core.reducer();
  out.count("inputs", reducer.columns().size());
  out.counts("columns", reducer.columns());
  out.numbers("mean", reducer.scaler().mean);
  out.numbers("deviation", reducer.scaler().deviation);
  write_matrix(out, "axes", reducer.axes());
  write_matrix(out, "support_vectors", core.support());
  out.numbers("coefficients", core.coefficient());
  out.number("bias", core.bias());
}

// ---- reading ----

std::optional<PhaseSet> phases_from(std::string_view letters) {
  PhaseSet phases;
  for (const char c : letters) {
    const auto phase = phase_from_char(c);
    if (phase == Phase::rest) phases.rest = true;
    if (phase == Phase::press) phases.press = true;
    if (phase == Phase::end) phases.end = true;
  }
  return phase_letters(phases) == letters ? std::optional(phases) : std::nullopt;
}

FeatureSetup read_setup(LineReader& in) {
  FeatureSetup setup;
  setup.taxels = in.count("taxels", 1, most_taxels);
  const std::string letters = in.text("phases");
  const auto phases = phases_from(letters);
  if (!phases) in.refuse("unknown phases", "letters of SPME", letters);
  setup.phases = phases.value_or(PhaseSet{});
  setup.options.skew = static_cast<SkewOf>(word(in, "skew", skew_words));
  setup.options.norm = static_cast<Norm>(word(in, "norm", norm_words));
  setup.options.spectrum = static_cast<SpectrumScale>(word(in, "spectrum", spectrum_words));
  setup.options.mode_bin_counts = in.number("mode_bin_counts");
  setup.window_s = in.number("window_s");
  setup.window_step_s = in.number("window_step_s");
  setup.sample_period_s = in.number("sample_period_s");
  setup.exploration = in.text("exploration");
  if (setup.window_s < 0 || setup.window_step_s < 0 || setup.sample_period_s < 0 ||
      !(setup.options.mode_bin_counts > 0))
    in.refuse("a length that is not positive");
  return setup;
}

Provenance read_provenance(LineReader& in) {
  Provenance provenance;
  provenance.bench = bench_words[word(in, "bench", bench_words)];
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

Matrix read_matrix(LineReader& in, std::string_view keyword, std::size_t cols) {
  const std::size_t rows = in.count(keyword, 0, most_rows);
  std::vector<std::vector<double>> read;  // grows with the text, whatever the count claims
  for (std::size_t r = 0; in.ok() && r < rows; ++r) read.push_back(in.numbers("row", cols));
  if (!in.ok() || rows == 0) return {};
  Matrix out(rows, cols);
  for (std::size_t r = 0; r < rows; ++r)
    std::copy(read[r].begin(), read[r].end(), out.row(r).begin());
  return out;
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
  info.gamma = in.number("gamma");
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
  Scaler scaler;
  scaler.mean = in.numbers("mean", inputs);
  scaler.deviation = in.numbers("deviation", inputs);
  Matrix axes = read_matrix(in, "axes", inputs);
  if (std::any_of(columns.begin(), columns.end(), [=](std::size_t c) { return c >= features; }))
    in.refuse("a column beyond the last feature");
  if (std::any_of(scaler.deviation.begin(), scaler.deviation.end(),
                  [](double d) { return !(d > 0.0); }))
    in.refuse("a deviation that is not positive");
  return {std::move(columns), std::move(scaler), std::move(axes)};
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

Result<StoredModel> read_body(std::string_view body) {
  LineReader in(body);
  Provenance provenance = read_provenance(in);
  FeatureSetup setup = read_setup(in);
  const auto reduction = static_cast<Reduction>(word(in, "reduction", reduction_words));
  std::vector<std::string> labels = read_names(in, "label", in.count("labels", 2, most_labels));
  if (std::adjacent_find(labels.begin(), labels.end(), std::greater_equal<>()) != labels.end())
    in.refuse("labels are not in order");
  // Each taxel has twelve lines of names: what a short file claims costs no memory.
  if (setup.taxels > body.size() / 12) in.refuse("more taxels than the file has features for");
  if (!in.ok()) return pass(in.status().error());
  const std::vector<std::string> expected = FeatureLayout(setup.taxels, setup.phases).names();
  const std::size_t columns = in.count("features", expected.size(), expected.size());
  std::vector<std::string> features = read_names(in, "feature", columns);
  if (features != expected) in.refuse("features are not those of the taxels and phases");
  std::vector<FabricCore> cores;
  const std::size_t pairs = labels.size() * (labels.size() - 1) / 2;
  for (std::size_t i = 0; in.ok() && i < pairs; ++i) cores.push_back(read_core(in, columns));
  std::optional<VoteAids> aids = read_aids(in, labels.size(), columns);
  in.finish();
  if (!in.ok()) return pass(in.status().error());
  return StoredModel{
      FabricModel(std::move(labels), std::move(features), reduction, std::move(cores)),
      std::move(setup), std::move(provenance), std::move(aids)};
}

// The text between header and checksum, once both are in order.
Result<std::string_view> body_of(std::string_view text) {
  if (!text.starts_with(header_word))
    return fail(Errc::parse, "not a model file", {}, model_file_header,
                std::string(text.substr(0, std::min(text.find('\n'), std::size_t{40}))));
  const std::string_view first = text.substr(0, text.find('\n'));
  if (first != model_file_header)
    return fail(Errc::unsupported, "a model file of another version", {}, model_file_header,
                std::string(first.substr(0, 40)), "Train the model again with this version");
  const std::size_t at = text.size() < crc_line_bytes ? 0 : text.size() - crc_line_bytes;
  const std::string_view trailer = text.substr(at);
  if (at < first.size() + 1 || !trailer.starts_with(crc_word) || trailer.back() != '\n')
    return fail(Errc::corrupt, "the model file was cut short", {}, "a last line with a checksum");
  std::uint32_t stored = 0;
  const std::string_view digits = trailer.substr(crc_word.size(), 8);
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), stored, 16);
  if (read.ptr != digits.data() + digits.size() || stored != crc_of(text.substr(0, at)))
    return fail(Errc::corrupt, "the model file was altered: its checksum disagrees");
  return text.substr(first.size() + 1, at - first.size() - 1);
}

std::string crc_line(std::string_view text) {
  std::array<char, 8> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + 8, crc_of(text), 16).ptr;
  const std::string hex(digits.data(), end);
  return std::string(crc_word) + std::string(8 - hex.size(), '0') + hex + "\n";
}

}  // namespace

Status save_model(const StoredModel& stored, std::ostream& out) {
  const FabricModel& model = stored.model;
  if (model.feature_names() != FeatureLayout(stored.setup.taxels, stored.setup.phases).names())
    return fail(Errc::invalid_argument, "features are not those of the taxels and phases", "model");
  LineWriter text;
  write_provenance(text, stored.provenance);
  write_setup(text, stored.setup);
  text.text("reduction", to_string(model.reduction()));
  text.count("labels", model.labels().size());
  for (const std::string& label : model.labels()) text.text("label", label);
  text.count("features", model.feature_names().size());
  for (const std::string& feature : model.feature_names()) text.text("feature", feature);
  for (const FabricCore& core : model.cores()) write_core(text, core);
  write_aids(text, stored.aids);
  const std::string whole = std::string(model_file_header) + "\n" + text.str();
  out << whole << crc_line(whole);
  if (!out.flush()) return fail(Errc::io, "cannot write the model");
  return {};
}

Result<StoredModel> load_model(std::istream& in) {
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return fail(Errc::io, "cannot read the model");
  const Result<std::string_view> body = body_of(text);
  if (!body) return pass(body.error());
  return read_body(*body);
}

std::string core_text(const FabricCore& core) {
  LineWriter text;
  write_core(text, core);
  return text.str();
}

Result<FabricCore> core_from_text(std::string_view text, std::size_t features) {
  LineReader in(text);
  FabricCore core = read_core(in, features);
  in.finish();
  if (!in.ok()) return pass(in.status().error());
  return core;
}

Status check_trial(const FeatureSetup& setup, const Trial& trial) {
  if (trial.taxels != setup.taxels)
    return fail(Errc::invalid_argument, "the model was trained for another sensor", trial.file,
                std::to_string(setup.taxels) + " taxels", std::to_string(trial.taxels));
  const PhaseSet phases = phases_of(trial);
  if (phases != setup.phases)
    return fail(Errc::invalid_argument, "the model was trained on other phases", trial.file,
                phase_letters(setup.phases), phase_letters(phases));
  return {};
}

Result<Vote> classify(const StoredModel& stored, const Trial& trial) {
  if (auto ok = check_trial(stored.setup, trial); !ok) return pass(ok.error());
  const auto features = extract(trial, stored.setup.options);
  if (!features) return pass(features.error());
  auto vote = stored.model.classify(*features);
  if (!vote) return pass(vote.error(), trial.file);
  return vote;
}

}  // namespace weft::classifier
