#include "classifier/model/model_file.hpp"

#include <algorithm>
#include <array>
#include <istream>
#include <iterator>
#include <ostream>

namespace weft::classifier {
namespace {

constexpr std::array<std::string_view, 3> modality_names{"fabric", "vibro", "imprint"};
constexpr std::string_view head_checksum_keyword = "head_crc32 ";
constexpr std::size_t most_stages_read = 1000;
constexpr std::size_t most_recordings = 1'000'000'000;

/// A first line of older files. The rest is as in current files, except for the fields of
/// ModelLines.
struct OlderHeader {
  std::string_view line;
  ModelKind kind;
  int learner_version = 6;
  bool has_pipeline = false;
};
constexpr std::array older_headers{
    OlderHeader{"weft-fabric-model 6", {Modality::fabric}},
    OlderHeader{"weft-fabric-model 5", {Modality::fabric}, 5},
    OlderHeader{"weft-fabric-model 4", {Modality::fabric}, 4},
    OlderHeader{"weft-fabric-model 3", {Modality::fabric}, 3},
    OlderHeader{"weft-recording-model 2", {Modality::vibro}},
    OlderHeader{"weft-recording-model 1", {Modality::vibro}, 6, true},
    OlderHeader{"weft-imprint-model 1", {Modality::imprint}},
    OlderHeader{"weft-live-model 2", {Modality::fabric, true}},
};

std::string_view first_line(std::string_view text) {
  return text.substr(0, text.find('\n'));
}

std::string_view keyword_of(std::string_view header) {
  return header.substr(0, header.rfind(' ') + 1);
}

bool begins_a_model(std::string_view text) {
  const auto is_of = [text](std::string_view header) {
    return text.starts_with(keyword_of(header));
  };
  return is_of(model_file_header) ||
         std::ranges::any_of(older_headers, [&](const auto& one) { return is_of(one.line); });
}

std::string describe(ModelKind kind) {
  return std::string("a model of modality ") + std::string(to_string(kind.modality)) +
         (kind.is_live ? ", live" : "");
}

/// Reads the kind of the file; the lines after it can be read from the result.
Result<ModelLines> begin_lines(std::string_view text) {
  const std::string_view first = first_line(text);
  const std::string_view rest = text.substr(std::min(first.size() + 1, text.size()));
  if (!begins_a_model(text))
    return fail({.code = Errc::parse,
                 .what = "not a model file",
                 .expected = std::string(model_file_header),
                 .got = std::string(first.substr(0, 40))});
  if (auto ok = check_line_ends(text); !ok) return pass(ok.error());
  ModelLines out{LineReader(rest, 1), {}};
  if (first == model_file_header) {
    out.kind.modality = static_cast<Modality>(word(out.in, "modality", modality_names));
    LineReader ahead = out.in;
    out.kind.is_live = ahead.count("stages", 0, most_stages_read) > 0;
    if (!ahead.ok()) return pass(ahead.status().error());
    return out;
  }
  const auto older = std::ranges::find(older_headers, first, &OlderHeader::line);
  if (older == older_headers.end())
    return fail({.code = Errc::unsupported,
                 .what = "unsupported version of the model file",
                 .expected = std::string(model_file_header) + " or a supported older version",
                 .got = std::string(first.substr(0, 40)),
                 .hint = "Train the model again with this version"});
  out.kind = older->kind;
  out.learner_version = older->learner_version;
  out.is_today = false;
  out.has_pipeline = older->has_pipeline;
  return out;
}

Status is_expected(ModelKind got, ModelKind expected) {
  if (got.modality != expected.modality)
    return fail({.code = Errc::parse,
                 .what = "model of another modality",
                 .expected = describe(expected),
                 .got = describe(got)});
  if (got.is_live == expected.is_live) return {};
  if (got.is_live)
    return fail({.code = Errc::unsupported,
                 .what = "model for live votes",
                 .expected = "a model of `weft ... train` without --live",
                 .hint = "Use this model as live_vote in a recipe, or train again without --live"});
  return fail({.code = Errc::parse,
               .what = "model without live votes",
               .expected = "a model with stages",
               .got = "a model of whole trials",
               .hint = "Train one with `weft fabric train --live`"});
}

}  // namespace

std::string_view to_string(Modality modality) {
  return word_in(modality_names, modality);
}

Result<ModelKind> find_model_kind(std::string_view beginning) {
  const auto lines = begin_lines(beginning);
  if (!lines) return pass(lines.error());
  return lines->kind;
}

StageLines read_stages(LineReader& in) {
  StageLines out;
  const std::size_t stages = in.count("stages", 0, most_stages_read);
  if (!in.ok() || stages == 0) return out;
  out.motion_frames = in.counts("motion_frames", stages);
  out.sample_rate_hz = in.positive("sample_rate_hz");
  return out;
}

Status write_model_file(ModelKind kind, const StageLines& stages, const Provenance& provenance,
                        std::string_view setup, std::span<const std::uint64_t> trained_on,
                        std::string_view body, std::ostream& out) {
  LineWriter head;
  head.lines(std::string(model_file_header) + "\n");
  head.text("modality", to_string(kind.modality));
  head.count("stages", stages.motion_frames.size());
  if (kind.is_live) {
    head.counts("motion_frames", stages.motion_frames);
    head.number("sample_rate_hz", stages.sample_rate_hz);
  }
  write_provenance(head, provenance);
  head.lines(setup);
  head.lines(checksum_line(head_checksum_keyword, head.str()));
  head.count("trained_on", trained_on.size());
  if (!trained_on.empty()) head.counts("digests", trained_on);
  out << head.str() << body << checksum_line(checksum_keyword, head.str(), body);
  if (!out.flush()) return fail({.code = Errc::io, .what = "model not written"});
  return {};
}

void write_parts(LineWriter& out, const TrainedLearner& learner,
                 const std::optional<VotePostprocessing>& postprocessing) {
  write_head(out, {learner.kind(), learner.view().kind()});
  write_labels(out, learner.labels());
  out.count("features", learner.feature_names().size());
  for (const std::string& feature : learner.feature_names()) out.text("feature", feature);
  write_learner(out, learner);
  write_postprocessing(out, postprocessing);
}

std::vector<std::uint64_t> ModelLines::read_trained_on() {
  if (!is_today) return {};
  in.text("head_crc32");
  const std::size_t count = in.count("trained_on", 0, most_recordings);
  if (!in.ok() || count == 0) return {};
  return in.counts("digests", count);
}

Result<std::string> read_model_text(std::istream& in) {
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return fail({.code = Errc::io, .what = "model not readable"});
  return text;
}

Result<ModelLines> open_model_file(std::string_view text, ModelKind expected) {
  // The kind is checked before the checksum, so that another file is not reported as a damaged one.
  auto lines = begin_lines(text);
  if (!lines && lines.error().code != Errc::corrupt) return lines;
  const Result<std::string_view> whole = check_checksum(text);
  if (!whole) return pass(whole.error());
  lines = begin_lines(*whole);
  if (!lines) return lines;
  if (auto ok = is_expected(lines->kind, expected); !ok) return pass(ok.error());
  if (lines->is_today && !expected.is_live) read_stages(lines->in);
  return lines;
}

Result<ModelLines> open_model_head(std::string_view beginning, ModelKind expected) {
  const std::string line = "\n" + std::string(head_checksum_keyword);
  const std::size_t at = beginning.find(line);
  auto lines = begin_lines(beginning);
  if (!lines) return lines;
  const std::string_view head = beginning.substr(0, at == std::string_view::npos ? at : at + 1);
  if (at == std::string_view::npos ||
      !beginning.substr(head.size()).starts_with(checksum_line(head_checksum_keyword, head)))
    return fail({.code = Errc::corrupt, .what = "head of the model file incomplete or altered"});
  if (auto ok = is_expected(lines->kind, expected); !ok) return pass(ok.error());
  return lines;
}

std::optional<ModelParts> read_parts(LineReader& in, const LearnerHead& head,
                                     std::vector<std::string> labels,
                                     const std::vector<std::string>& expected) {
  const std::size_t columns = in.count("features", expected.size(), expected.size());
  std::vector<std::string> features = read_names(in, "feature", columns);
  const auto other = std::mismatch(features.begin(), features.end(), expected.begin());
  if (other.first != features.end())
    in.refuse("feature differs from the settings in the model file", *other.second, *other.first);
  auto learner = read_learner(in, head, std::move(labels), std::move(features));
  if (!learner) return std::nullopt;
  const FabricModel* cores = learner->cores();
  const std::size_t sigmoids = cores != nullptr ? cores->cores().size() : 0;
  // Cores are calibrated on their own features, other learners on those of the trial.
  const std::size_t checked_columns = cores != nullptr ? cores->feature_names().size() : columns;
  auto postprocessing =
      read_postprocessing(in, learner->labels().size(), checked_columns, sigmoids);
  if (!in.ok()) return std::nullopt;
  return ModelParts{std::move(*learner), std::move(postprocessing)};
}

std::optional<ModelParts> read_parts(LineReader& in, int learner_version,
                                     const Result<std::vector<std::string>>& expected) {
  const LearnerHead head = read_head(in, learner_version);
  std::vector<std::string> labels = read_labels(in);
  if (!expected) in.refuse(expected.error().what, expected.error().expected, expected.error().got);
  if (!in.ok()) return std::nullopt;
  return read_parts(in, head, std::move(labels), *expected);
}

Status check_feature_names(const TrainedLearner& learner,
                           const Result<std::vector<std::string>>& expected) {
  if (expected && learner.feature_names() == *expected) return {};
  return fail(
      {.code = Errc::invalid_argument, .where = "model", .what = "features differ from the setup"});
}

}  // namespace weft::classifier
