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
constexpr std::size_t least_slides = 2;  // of a label in a stage
constexpr double most_rate_hz = 1e6;
constexpr std::size_t most_head_bytes = std::size_t{64} << 10;

/// The fewest that last so long: a rule that waits for half a second hears the stage of it.
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

Status has_rate(const FeatureSetup& setup, double sample_rate_hz) {
  if (std::abs(setup.sample_period_s * sample_rate_hz - 1) <= rate_rounding) return {};
  return fail({.code = Errc::corrupt,
               .where = "live model",
               .what = "a stage was trained at another sample rate",
               .expected = std::to_string(1 / sample_rate_hz) + " s",
               .got = std::to_string(setup.sample_period_s) + " s"});
}

Status fits(const LiveStage& stage, const LiveStage& first, double sample_rate_hz) {
  const FeatureSetup& setup = stage.model.setup;
  if (setup.phases.end || setup.window_s > 0)
    return fail({.code = Errc::corrupt,
                 .where = "live model",
                 .what = "a stage of a whole slide or of windows"});
  const bool same = setup.taxels == first.model.setup.taxels &&
                    setup.phases == first.model.setup.phases &&
                    setup.exploration == first.model.setup.exploration &&
                    stage.model.learner.labels() == first.model.learner.labels();
  if (!same)
    return fail({.code = Errc::corrupt,
                 .where = "live model",
                 .what = "stages of different sensors or fabrics"});
  return has_rate(setup, sample_rate_hz);
}

tl::unexpected<Error> cut_short() {
  return fail({.code = Errc::corrupt,
               .where = "live model",
               .what = "the live model was cut short or altered"});
}

/// What precedes the first stage.
struct Opening {
  struct Stage {
    std::size_t motion_frames = 0, bytes = 0;
  };
  double sample_rate_hz = 0;
  std::vector<Stage> stages;
};

constexpr std::string_view live_header_keyword = "weft-live-model ";
constexpr std::string_view last_keyword = "\ncrc32 ";

/// Refuses another kind of file, or another version.
Status is_live_model(std::string_view text) {
  const std::string_view first = text.substr(0, text.find('\n'));
  if (!first.starts_with(live_header_keyword))
    return fail({.code = Errc::parse,
                 .what = "not a model for live votes",
                 .expected = staged_file_header,
                 .got = std::string(first.substr(0, 40)),
                 .hint = "weft train --live makes one"});
  if (auto ok = check_line_ends(text); !ok) return ok;
  if (first == staged_file_header) return {};
  return fail({.code = Errc::unsupported,
               .what = "a live model of another version",
               .expected = staged_file_header,
               .got = std::string(first.substr(0, 40)),
               .hint = "Train the model again with this version: weft train --live"});
}

Result<Opening> read_opening(std::string_view body) {
  LineReader in(body);
  Opening out;
  out.sample_rate_hz = in.positive("sample_rate_hz");
  const std::size_t stages = in.count("stages", 1, most_stages);
  for (std::size_t i = 0; in.ok() && i < stages; ++i) {
    const std::vector<std::size_t> one = in.counts("stage", 2);
    if (in.ok()) out.stages.push_back({one[0], one[1]});
  }
  in.finish();
  if (!in.ok()) return pass(in.status().error());
  std::size_t before = 0;
  for (const Opening::Stage& stage : out.stages) {
    if (stage.motion_frames <= before) return cut_short();
    before = stage.motion_frames;
  }
  if (out.sample_rate_hz >= most_rate_hz) return cut_short();
  return out;
}

/// Takes it off the front, checksum and all.
Result<Opening> pop_opening(std::string_view& text) {
  if (Status ok = is_live_model(text); !ok) return pass(ok.error());
  const std::size_t last = text.find(last_keyword);
  const std::size_t end = last == std::string_view::npos ? last : text.find('\n', last + 1);
  if (end == std::string_view::npos) return cut_short();
  const std::size_t header_bytes = std::string_view(staged_file_header).size() + 1;
  const auto body = check_checksum(text.substr(0, end + 1), header_bytes);
  if (!body) return pass(body.error(), "live model");
  text.remove_prefix(end + 1);
  return read_opening(*body);
}

Result<LiveStage> read_stage(std::string_view& text, const Opening::Stage& stage) {
  if (stage.bytes > text.size()) return cut_short();
  std::istringstream in{std::string(text.substr(0, stage.bytes))};
  text.remove_prefix(stage.bytes);
  auto model = load_model(in);
  if (!model) return pass(model.error(), "stage " + std::to_string(stage.motion_frames));
  return LiveStage{stage.motion_frames, std::move(*model)};
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
                 .what = "the sample rate is not known, so neither is how far a slide had come",
                 .expected = "over 0 and under 1 MHz",
                 .got = std::to_string(sample_rate_hz)});
  std::vector<std::string> labels;
  std::size_t longest = 0;
  for (const Trial& slide : slides) {
    labels.push_back(slide.label);
    longest = std::max(longest, slide.motion_samples());
  }
  if (Status ok = check_labels(labels); !ok) return pass(ok.error());
  StagedModel out{sample_rate_hz, {}};
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
    if (knew && !model->postprocessing) break;  // what is sure so far must not be less so later
    out.stages.push_back({frames, std::move(*model)});
  }
  if (!out.stages.empty()) return out;
  return fail({.code = Errc::invalid_argument,
               .where = "live model",
               .what = "no slide is long enough for a vote before its end",
               .expected = "two slides of every fabric, half a second long",
               .hint = "Record longer slides"});
}

Status save_staged(const StagedModel& model, std::ostream& out) {
  LineWriter opening;
  opening.number("sample_rate_hz", model.sample_rate_hz);
  opening.count("stages", model.stages.size());
  std::string models;
  for (const LiveStage& stage : model.stages) {
    std::ostringstream text;
    if (Status ok = save_model(stage.model, text); !ok) return ok;
    opening.counts("stage", std::array{stage.motion_frames, text.view().size()});
    models += text.view();
  }
  out << with_checksum(staged_file_header, opening.str()) << models;
  if (!out.flush()) return fail({.code = Errc::io, .what = "cannot write the model"});
  return {};
}

Result<StagedModel> load_staged(std::istream& in) {
  const std::string whole{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return fail({.code = Errc::io, .what = "cannot read the model"});
  std::string_view text = whole;
  const auto opening = pop_opening(text);
  if (!opening) return pass(opening.error());
  StagedModel out{opening->sample_rate_hz, {}};
  for (const Opening::Stage& one : opening->stages) {
    auto stage = read_stage(text, one);
    if (!stage) return pass(stage.error());
    out.stages.push_back(std::move(*stage));
    if (Status ok = fits(out.stages.back(), out.stages.front(), out.sample_rate_hz); !ok)
      return pass(ok.error());
  }
  if (!text.empty()) return cut_short();
  return out;
}

Result<StagedHead> load_staged_head(std::istream& in) {
  std::string held(most_head_bytes, '\0');
  in.read(held.data(), static_cast<std::streamsize>(held.size()));
  if (in.bad()) return fail({.code = Errc::io, .what = "cannot read the model"});
  std::string_view text = std::string_view(held).substr(0, static_cast<std::size_t>(in.gcount()));
  const auto opening = pop_opening(text);
  if (!opening) return pass(opening.error());
  auto first = load_model_head(text);
  if (!first) return pass(first.error());
  if (Status ok = has_rate(first->setup, opening->sample_rate_hz); !ok) return pass(ok.error());
  return StagedHead{opening->sample_rate_hz, std::move(*first)};
}

bool is_sure(const StopRule& rule, const LivePrediction& answer) {
  if (answer.none_of_these || answer.winner >= answer.probability.size()) return false;
  return answer.slide_s >= rule.least_slide_s * (1 - rate_rounding) &&
         answer.probability[answer.winner] >= rule.sure_probability;
}

LiveVoter::LiveVoter(std::shared_ptr<const StagedModel> model)
    : model_(std::move(model)),
      stream_(model_->last().setup.taxels, model_->last().setup.options) {}

void LiveVoter::restart() {
  stream_.restart();
  next_stage_ = 0;
}

// Phases that the model does not know would be features that it does not take.
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
  const auto features = stream_.features();
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
