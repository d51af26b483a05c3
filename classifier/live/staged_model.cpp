#include "classifier/live/staged_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <iterator>
#include <map>
#include <ostream>
#include <sstream>
#include <utility>

#include "classifier/base/line_io.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/learners/class_folds.hpp"

namespace weft::classifier {
namespace {

constexpr double shortest_s = 0.5;
constexpr std::size_t least_slides = 2;  // least strokes of a label in a stage
constexpr double most_rate_hz = 1e6;
constexpr std::size_t most_head_bytes = std::size_t{64} << 10;

/// Fewest frames with at least this duration; a stop rule of half a second then includes its stage.
std::size_t frames_in(double seconds, double sample_rate_hz) {
  return static_cast<std::size_t>(std::ceil(seconds * sample_rate_hz * (1 - rate_rounding)));
}

std::vector<Trial> as_long_as(std::span<const Trial> slides, std::size_t frames) {
  std::vector<Trial> out;
  for (const Trial& slide : slides)
    if (slide.motion_samples() >= frames) out.push_back(begun_slide(slide, frames));
  return out;
}

bool enough_of_each(std::span<const Trial> slides, std::span<const Trial> of_all) {
  std::map<std::string, std::size_t> found;
  for (const Trial& one : of_all) found[one.label];
  for (const Trial& one : slides) ++found[one.label];
  return std::ranges::all_of(found, [](const auto& label) { return label.second >= least_slides; });
}

Result<StoredModel> train_stage(const std::vector<Trial>& slides, double sample_rate_hz,
                                const StagedOptions& options) {
  FeatureSetup setup;
  setup.taxels = slides.front().taxels;
  setup.phases = phases_of(slides.front());
  setup.options = options.features;
  setup.sample_period_s = 1 / sample_rate_hz;
  setup.exploration = options.exploration;
  const auto matrix = build_feature_matrix(slides, options.features, options.training.threads);
  if (!matrix) return pass(matrix.error());
  auto trained = train_learner(*matrix, options.learner, options.training);
  if (!trained) return pass(trained.error());
  auto postprocessing = fit_postprocessing(trained->trained, *matrix, options.training);
  if (!postprocessing) return pass(postprocessing.error());
  Provenance provenance = options.provenance;
  const FoldReport folds = fold_report(*matrix, options.learner, options.training);
  if (!folds.as_requested()) provenance.training += ", folds of this stage: " + format_folds(folds);
  return StoredModel{std::move(trained->trained), std::move(setup), std::move(provenance),
                     std::move(*postprocessing)};
}

tl::unexpected<Error> no_live_model(const char* what) {
  return fail({.code = Errc::corrupt, .where = "live model", .what = what});
}
tl::unexpected<Error> cut_short() {
  return no_live_model("live model incomplete or altered");
}

Status has_rate(const FeatureSetup& setup, double sample_rate_hz) {
  if (std::abs(setup.sample_period_s * sample_rate_hz - 1) <= rate_rounding) return {};
  return fail({.code = Errc::corrupt,
               .where = "live model",
               .what = "wrong sample period of a stage",
               .expected = std::to_string(1 / sample_rate_hz) + " s",
               .got = std::to_string(setup.sample_period_s) + " s"});
}

Status check_stages(const StagedModel& model) {
  const LiveStage& first = model.stages.front();
  std::size_t before = 0;
  for (const LiveStage& stage : model.stages) {
    const FeatureSetup& setup = stage.model.setup;
    const bool same = setup.taxels == first.model.setup.taxels &&
                      setup.phases == first.model.setup.phases &&
                      setup.exploration == first.model.setup.exploration &&
                      stage.model.learner.labels() == first.model.learner.labels();
    if (!same) return no_live_model("stages with different sensors or fabrics");
    if (setup.phases.end || setup.window_s > 0)
      return no_live_model("stage of a whole slide or of windows");
    if (stage.motion_frames <= before) return no_live_model("stages not in order of length");
    if (auto ok = has_rate(setup, model.sample_rate_hz); !ok) return ok;
    before = stage.motion_frames;
  }
  return {};
}

Status check_opening(const StageLines& stages) {
  const bool right = !stages.motion_frames.empty() && stages.motion_frames.size() <= most_stages &&
                     stages.sample_rate_hz > 0 && stages.sample_rate_hz < most_rate_hz;
  return right ? Status() : no_live_model("number of stages or sample rate out of range");
}

// "weft-live-model 2": a head with rate, frames and bytes of each stage and a checksum, then the
// model files of the stages, each with its own checksum.

struct Opening {
  StageLines stages;
  std::vector<std::size_t> bytes;
};

constexpr std::string_view header_of_version_2 = "weft-live-model 2\n";

/// Reads the head and removes it from the front of `text`.
Result<Opening> pop_opening(std::string_view& text) {
  const std::size_t last = text.find("\n" + std::string(checksum_keyword));
  const std::size_t end = last == std::string_view::npos ? last : text.find('\n', last + 1);
  if (end == std::string_view::npos) return cut_short();
  const auto body = check_checksum(text.substr(0, end + 1));
  if (!body) return pass(body.error(), "live model");
  LineReader in(body->substr(header_of_version_2.size()), 1);
  Opening out;
  out.stages.sample_rate_hz = in.positive("sample_rate_hz");
  const std::size_t stages = in.count("stages", 1, most_stages);
  for (std::size_t i = 0; in.ok() && i < stages; ++i) {
    const std::vector<std::size_t> one = in.counts("stage", 2);
    if (!in.ok()) break;
    out.stages.motion_frames.push_back(one[0]);
    out.bytes.push_back(one[1]);
  }
  in.finish();
  if (!in.ok()) return pass(in.status().error());
  if (auto ok = check_opening(out.stages); !ok) return pass(ok.error());
  text.remove_prefix(end + 1);
  return out;
}

Result<StagedModel> read_version_2(std::string_view text) {
  const auto opening = pop_opening(text);
  if (!opening) return pass(opening.error());
  StagedModel out{opening->stages.sample_rate_hz, {}};
  for (std::size_t i = 0; i < opening->bytes.size(); ++i) {
    if (opening->bytes[i] > text.size()) return cut_short();
    std::istringstream in{std::string(text.substr(0, opening->bytes[i]))};
    text.remove_prefix(opening->bytes[i]);
    auto model = load_model<FeatureSetup>(in);
    if (!model) return pass(model.error(), "stage " + std::to_string(i + 1));
    out.stages.push_back({opening->stages.motion_frames[i], std::move(*model)});
  }
  if (!text.empty()) return cut_short();
  if (auto ok = check_stages(out); !ok) return pass(ok.error());
  return out;
}

/// Reads the head from the beginning of a file.
Result<StagedHead> read_head_of_version_2(std::string_view text) {
  const auto opening = pop_opening(text);
  if (!opening) return pass(opening.error());
  text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  LineReader in(text, 1);
  Provenance provenance = read_provenance(in);
  FeatureSetup setup = SetupText<FeatureSetup>::read(in);
  if (!in.ok()) return pass(in.status().error());
  return StagedHead{opening->stages.sample_rate_hz, std::move(setup), std::move(provenance)};
}

StagedHead read_staged_head(LineReader& in, StageLines& stages) {
  stages = read_stages(in);
  Provenance provenance = read_provenance(in);
  FeatureSetup setup = SetupText<FeatureSetup>::read(in);
  return {stages.sample_rate_hz, std::move(setup), std::move(provenance)};
}

Result<StagedHead> read_head_of_today(std::string_view beginning) {
  auto lines = open_model_head(beginning, {Modality::fabric, true});
  if (!lines) return pass(lines.error());
  StageLines stages;
  StagedHead out = read_staged_head(lines->in, stages);
  if (!lines->in.ok()) return pass(lines->in.status().error());
  return out;
}

/// Reads the parts of one stage: its training options and its trained parts.
std::optional<LiveStage> read_stage(ModelLines& lines, const StagedHead& head,
                                    std::size_t motion_frames) {
  Provenance provenance = head.provenance;
  provenance.training = lines.in.text("stage_training");
  const auto names = SetupText<FeatureSetup>::feature_names(head.setup, lines.in.left());
  auto parts = read_parts(lines.in, lines.learner_version, names);
  if (!parts) return std::nullopt;
  return LiveStage{motion_frames,
                   {std::move(parts->learner), head.setup, std::move(provenance),
                    std::move(parts->postprocessing)}};
}

}  // namespace

double StagedModel::slide_s(std::size_t stage) const {
  return static_cast<double>(stages[stage].motion_frames) / sample_rate_hz;
}

std::vector<double> stage_seconds(double longest_s) {
  std::vector<double> out;
  if (longest_s >= shortest_s) out.push_back(shortest_s);
  if (longest_s >= 1) out.push_back(1);
  for (double whole = 2; whole <= longest_s && out.size() < most_stages; whole *= 2) {
    out.push_back(whole);
    if (1.5 * whole <= longest_s) out.push_back(1.5 * whole);
  }
  return out;
}

Trial begun_slide(const Trial& trial, std::size_t motion_frames) {
  Trial out{trial.file, trial.label, trial.group, trial.taxels, {}, {}};
  std::size_t moved = 0;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] == Phase::end || trial.phase[i] == Phase::none) continue;
    if (trial.phase[i] == Phase::motion && ++moved > motion_frames) continue;
    const auto row = trial.row(i);
    out.phase.push_back(trial.phase[i]);
    out.counts.insert(out.counts.end(), row.begin(), row.end());
  }
  return out;
}

Result<StagedModel> train_staged(std::span<const Trial> slides, double sample_rate_hz,
                                 const StagedOptions& options) {
  if (!(sample_rate_hz > 0 && sample_rate_hz < most_rate_hz))
    return fail({.code = Errc::invalid_argument,
                 .where = "live model",
                 .what = "sample rate not known",
                 .expected = "above 0 and below 1e6 Hz",
                 .got = std::to_string(sample_rate_hz)});
  std::vector<std::string> labels;
  std::size_t longest = 0;
  for (const Trial& slide : slides) {
    labels.push_back(slide.label);
    longest = std::max(longest, slide.motion_samples());
  }
  if (Status ok = check_labels(labels); !ok) return pass(ok.error());
  StagedModel out{sample_rate_hz, {}, content_digests(slides)};
  const double longest_s = static_cast<double>(longest) / sample_rate_hz;
  for (const double seconds : stage_seconds(longest_s * (1 + rate_rounding))) {
    const std::size_t frames = frames_in(seconds, sample_rate_hz);
    const bool is_new = out.stages.empty() || frames > out.stages.back().motion_frames;
    if (frames == 0 || !is_new) continue;
    const std::vector<Trial> long_enough = as_long_as(slides, frames);
    if (!enough_of_each(long_enough, slides)) break;
    auto model = train_stage(long_enough, sample_rate_hz, options);
    if (!model) return pass(model.error(), std::to_string(seconds) + " s of slide");
    const bool knew = !out.stages.empty() && out.stages.back().model.postprocessing;
    if (knew && !model->postprocessing)
      break;  // a later stage must not lose the probabilities of an earlier one
    out.stages.push_back({frames, std::move(*model)});
  }
  if (!out.stages.empty()) return out;
  return fail({.code = Errc::invalid_argument,
               .where = "live model",
               .what = "slides too short for a live vote",
               .expected = "at least two slides of 0.5 s per fabric",
               .hint = "Record longer slides"});
}

Status save_staged(const StagedModel& model, std::ostream& out) {
  const StoredModel& first = model.stages.front().model;
  StageLines stages{{}, model.sample_rate_hz};
  LineWriter setup, body;
  SetupText<FeatureSetup>::write(setup, first.setup);
  for (const LiveStage& stage : model.stages) {
    const StoredModel& own = stage.model;
    const std::size_t columns = own.learner.feature_names().size();
    const auto names = SetupText<FeatureSetup>::feature_names(own.setup, columns);
    if (auto ok = check_feature_names(own.learner, names); !ok) return ok;
    stages.motion_frames.push_back(stage.motion_frames);
    body.text("stage_training", own.provenance.training);
    write_parts(body, own.learner, own.postprocessing);
  }
  return write_model_file({Modality::fabric, true}, stages, first.provenance, setup.str(),
                          model.trained_on, body.str(), out);
}

Result<StagedModel> load_staged(std::istream& in) {
  const auto text = read_model_text(in);
  if (!text) return pass(text.error());
  if (text->starts_with(header_of_version_2)) return read_version_2(*text);
  auto lines = open_model_file(*text, {Modality::fabric, true});
  if (!lines) return pass(lines.error());
  StageLines stages;
  const StagedHead head = read_staged_head(lines->in, stages);
  StagedModel out{stages.sample_rate_hz, {}, lines->read_trained_on()};
  if (lines->in.ok())
    if (auto ok = check_opening(stages); !ok) return pass(ok.error());
  for (const std::size_t frames : stages.motion_frames) {
    auto stage = read_stage(*lines, head, frames);
    if (!stage) break;
    out.stages.push_back(std::move(*stage));
  }
  lines->in.finish();
  if (!lines->in.ok()) return pass(lines->in.status().error(), "live model");
  if (auto ok = check_stages(out); !ok) return pass(ok.error());
  return out;
}

Result<StagedHead> load_staged_head(std::istream& in) {
  std::string beginning(most_head_bytes, '\0');
  in.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  if (in.bad()) return fail({.code = Errc::io, .what = "model not readable"});
  beginning.resize(static_cast<std::size_t>(in.gcount()));
  const auto out = beginning.starts_with(header_of_version_2) ? read_head_of_version_2(beginning)
                                                              : read_head_of_today(beginning);
  if (!out) return out;
  if (Status ok = has_rate(out->setup, out->sample_rate_hz); !ok) return pass(ok.error());
  return out;
}

bool is_sure(const StopRule& rule, const LivePrediction& answer) {
  if (answer.none_of_these || answer.winner >= answer.probability.size()) return false;
  return answer.slide_s >= rule.least_slide_s * (1 - rate_rounding) &&
         answer.probability[answer.winner] >= rule.sure_probability;
}

LiveVoter::LiveVoter(std::shared_ptr<const StagedModel> model)
    : model_(std::move(model)), stream_(model_->last().setup.taxels, model_->last().setup.options) {
  for (const LiveStage& stage : model_->stages) wanted_.push_back(used_blocks(stage.model));
}

void LiveVoter::restart() {
  stream_.restart();
  next_stage_ = 0;
}

// Phases that the model was not trained with would add features that it cannot use.
bool LiveVoter::consumes(Phase phase) const {
  const PhaseSet& known = model_->last().setup.phases;
  return phase == Phase::motion || (phase == Phase::rest && known.rest) ||
         (phase == Phase::press && known.press);
}

Result<std::optional<LivePrediction>> LiveVoter::add(Phase phase, std::span<const double> counts) {
  if (!consumes(phase) || next_stage_ == model_->stages.size())
    return std::optional<LivePrediction>{};
  if (Status ok = stream_.add(phase, counts); !ok) return pass(ok.error(), "live vote");
  if (stream_.motion_frames() < model_->stages[next_stage_].motion_frames)
    return std::optional<LivePrediction>{};
  auto answer = check();
  ++next_stage_;
  if (!answer) return pass(answer.error(), "live vote");
  return std::optional<LivePrediction>(std::move(*answer));
}

Result<LivePrediction> LiveVoter::check() {
  const StoredModel& model = model_->stages[next_stage_].model;
  const auto features = stream_.features(wanted_[next_stage_]);
  if (!features) return pass(features.error());
  auto predicted = predict(model.learner, model.postprocessing, *features);
  if (!predicted) return pass(predicted.error());
  LivePrediction out;
  out.slide_s = model_->slide_s(next_stage_);
  out.winner = predicted->ballot.winner;
  out.probability = std::move(predicted->probability);
  out.none_of_these = predicted->none_of_these;
  return out;
}

}  // namespace weft::classifier
