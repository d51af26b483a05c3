#include "classifier/live/staged_model.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <istream>
#include <iterator>
#include <map>
#include <ostream>
#include <sstream>

namespace weft::classifier {
namespace {

constexpr double shortest_s = 0.5;
constexpr std::size_t least_slides = 2;  // of a label in a stage
constexpr std::size_t most_stages = 64;
constexpr std::size_t most_head_bytes = std::size_t{64} << 10;

std::size_t motion_frames_of(const Trial& trial) {
  return static_cast<std::size_t>(std::ranges::count(trial.phase, Phase::motion));
}

/// The fewest that last so long: a rule that waits for half a second hears the stage of it.
std::size_t frames_in(double seconds, double sample_rate_hz) {
  auto frames = static_cast<std::size_t>(std::ceil(seconds * sample_rate_hz));
  if (static_cast<double>(frames) / sample_rate_hz < seconds) ++frames;  // by the last bit
  return frames;
}

std::vector<Trial> as_long_as(std::span<const Trial> slides, std::size_t frames) {
  std::vector<Trial> out;
  for (const Trial& slide : slides)
    if (motion_frames_of(slide) >= frames) out.push_back(begun_slide(slide, frames));
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
  auto aids = learn_aids(trained->trained, *matrix, options.training);
  if (!aids) return pass(aids.error());
  return StoredModel{std::move(trained->trained), std::move(setup), options.provenance,
                     std::move(*aids)};
}

Status fits(const LiveStage& stage, const LiveStage& first) {
  const FeatureSetup& setup = stage.model.setup;
  if (setup.phases.end || setup.window_s > 0)
    return fail(Errc::corrupt, "a stage of a whole slide or of windows", "live model");
  const bool same = setup.taxels == first.model.setup.taxels &&
                    setup.phases == first.model.setup.phases &&
                    setup.exploration == first.model.setup.exploration &&
                    stage.model.learner.labels() == first.model.learner.labels();
  if (!same) return fail(Errc::corrupt, "stages of different sensors or fabrics", "live model");
  return {};
}

tl::unexpected<Error> cut_short() {
  return fail(Errc::corrupt, "the live model was cut short or altered", "live model");
}

/// Takes "WORD NUMBER[ NUMBER]\n" off the front.
template <class... Numbers>
bool take_line(std::string_view& text, std::string_view word, Numbers&... numbers) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos || !text.starts_with(word)) return false;
  const char* at = text.data() + word.size();
  const char* const last = text.data() + end;
  [[maybe_unused]] const auto one = [&](auto& number) {
    if (at == last || *at != ' ') return false;
    const auto [read_to, error] = std::from_chars(at + 1, last, number);
    at = read_to;
    return error == std::errc{};
  };
  const bool all = (one(numbers) && ...) && at == last;
  text.remove_prefix(end + 1);
  return all;
}

/// The lines before the first stage.
struct Opening {
  double sample_rate_hz = 0;
  std::size_t stages = 0;
};

Result<Opening> take_opening(std::string_view& text) {
  const std::string_view whole = text;
  if (!take_line(text, staged_file_header))
    return fail(Errc::parse, "not a model for live votes", {}, staged_file_header,
                std::string(whole.substr(0, std::min(whole.find('\n'), std::size_t{40}))),
                "weft train --live makes one");
  Opening out;
  const bool head = take_line(text, "sample_rate_hz", out.sample_rate_hz) &&
                    take_line(text, "stages", out.stages);
  if (!head || out.stages == 0 || out.stages > most_stages) return cut_short();
  if (!(out.sample_rate_hz > 0 && out.sample_rate_hz < 1e6)) return cut_short();
  return out;
}

Result<LiveStage> read_stage(std::string_view& text) {
  std::size_t frames = 0, bytes = 0;
  if (!take_line(text, "stage", frames, bytes) || bytes > text.size()) return cut_short();
  std::istringstream in{std::string(text.substr(0, bytes))};
  text.remove_prefix(bytes);
  auto model = load_model(in);
  if (!model) return pass(model.error(), "stage " + std::to_string(frames));
  return LiveStage{frames, std::move(*model)};
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
  if (!(sample_rate_hz > 0 && sample_rate_hz < 1e6))
    return fail(Errc::invalid_argument,
                "the sample rate is not known, so neither is how far a slide had come",
                "live model", "over 0 and under 1 MHz", std::to_string(sample_rate_hz));
  std::size_t longest = 0;
  for (const Trial& slide : slides) longest = std::max(longest, motion_frames_of(slide));
  StagedModel out{sample_rate_hz, {}};
  for (const double seconds : stage_seconds(static_cast<double>(longest) / sample_rate_hz)) {
    const std::size_t frames = frames_in(seconds, sample_rate_hz);
    const bool is_new = out.stages.empty() || frames > out.stages.back().motion_frames;
    if (frames == 0 || !is_new) continue;
    const std::vector<Trial> long_enough = as_long_as(slides, frames);
    if (!enough_of_each(long_enough, slides)) break;
    auto model = train_stage(long_enough, sample_rate_hz, options);
    if (!model) return pass(model.error(), std::to_string(seconds) + " s of slide");
    out.stages.push_back({frames, std::move(*model)});
  }
  if (!out.stages.empty()) return out;
  return fail(Errc::invalid_argument, "no slide is long enough for a vote before its end",
              "live model", "two slides of every fabric, half a second long", {},
              "Record longer slides");
}

Status save_staged(const StagedModel& model, std::ostream& out) {
  std::array<char, 32> rate{};
  const auto end = std::to_chars(rate.data(), rate.data() + rate.size(), model.sample_rate_hz).ptr;
  out << staged_file_header << "\nsample_rate_hz "
      << std::string_view(rate.data(), static_cast<std::size_t>(end - rate.data())) << "\nstages "
      << model.stages.size() << '\n';
  for (const LiveStage& stage : model.stages) {
    std::ostringstream text;
    if (Status ok = save_model(stage.model, text); !ok) return ok;
    out << "stage " << stage.motion_frames << ' ' << text.view().size() << '\n' << text.view();
  }
  if (!out.flush()) return fail(Errc::io, "cannot write the model");
  return {};
}

Result<StagedModel> load_staged(std::istream& in) {
  const std::string whole{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return fail(Errc::io, "cannot read the model");
  std::string_view text = whole;
  const auto opening = take_opening(text);
  if (!opening) return pass(opening.error());
  StagedModel out{opening->sample_rate_hz, {}};
  for (std::size_t i = 0; i < opening->stages; ++i) {
    auto stage = read_stage(text);
    if (!stage) return pass(stage.error());
    if (stage->motion_frames <= (i == 0 ? 0 : out.stages.back().motion_frames)) return cut_short();
    out.stages.push_back(std::move(*stage));
    if (Status ok = fits(out.stages.back(), out.stages.front()); !ok) return pass(ok.error());
  }
  if (!text.empty()) return cut_short();
  return out;
}

Result<StagedHead> load_staged_head(std::istream& in) {
  std::string held(most_head_bytes, '\0');
  in.read(held.data(), static_cast<std::streamsize>(held.size()));
  if (in.bad()) return fail(Errc::io, "cannot read the model");
  std::string_view text = std::string_view(held).substr(0, static_cast<std::size_t>(in.gcount()));
  const auto opening = take_opening(text);
  if (!opening) return pass(opening.error());
  std::size_t frames = 0, bytes = 0;
  if (!take_line(text, "stage", frames, bytes)) return cut_short();
  auto first = load_model_head(text);
  if (!first) return pass(first.error());
  return StagedHead{opening->sample_rate_hz, std::move(*first)};
}

}  // namespace weft::classifier
