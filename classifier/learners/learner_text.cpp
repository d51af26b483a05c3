#include "classifier/learners/learner_text.hpp"

#include <algorithm>
#include <array>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/model_text.hpp"

namespace weft::classifier {
namespace {

// Learners in earlier versions of a fabric file, in their order.
constexpr std::array kinds = {Learner::pvalue, Learner::pca, Learner::all,
                              Learner::lda,    Learner::svc, Learner::trees};
constexpr std::size_t kinds_of_version_3 = 3;
constexpr std::size_t kinds_of_version_5 = 5;

constexpr std::size_t most_folds = 1'000'000'000;
constexpr std::size_t most_components = 1'000'000;

Learner read_kind(LineReader& in, std::string_view keyword, std::size_t known) {
  const std::string word = in.text(keyword);
  const auto end = kinds.begin() + static_cast<std::ptrdiff_t>(known);
  const auto found =
      std::find_if(kinds.begin(), end, [&](Learner kind) { return to_string(kind) == word; });
  if (found != end) return *found;
  std::string names;
  for (auto kind = kinds.begin(); kind != end; ++kind)
    names += (names.empty() ? "" : ", ") + std::string(to_string(*kind));
  in.refuse("unknown " + std::string(keyword), names, word);
  return kinds.front();
}

void write_view(LineWriter& out, const FeatureView& view) {
  if (const auto* scaler = std::get_if<Scaler>(&view.table())) write_scaler(out, *scaler);
  if (const auto* ranks = std::get_if<RankTable>(&view.table()))
    write_matrix(out, "knots", ranks->knots());
  if (const auto* normal = std::get_if<NormalScores>(&view.table()))
    write_matrix(out, "knots", normal->ranks().knots());
  if (const auto* standardised = std::get_if<Standardised>(&view.table()))
    write_scaler(out, standardised->scaler);
  if (const auto* components = std::get_if<PrincipalComponents>(&view.table())) {
    write_scaler(out, components->scaler);
    write_matrix(out, "axes", components->axes);
    out.number("explained", components->explained);
  }
}

RankTable read_ranks(LineReader& in, std::size_t features) {
  Matrix knots = read_matrix(in, "knots", features);
  if (knots.rows() == 0) in.refuse("too few knots", "at least 1", "0");
  for (std::size_t r = 1; r < knots.rows(); ++r)
    for (std::size_t c = 0; c < features; ++c)
      if (knots(r, c) < knots(r - 1, c))
        in.refuse("knots of a feature not ascending", "no knot less than the one before",
                  "knot " + std::to_string(r));
  return RankTable(std::move(knots));
}

FeatureView read_view(LineReader& in, View view, std::size_t features) {
  if (view == View::compressed) return FeatureView(FeatureView::Table(read_scaler(in, features)));
  if (view == View::ranked) return FeatureView(FeatureView::Table(read_ranks(in, features)));
  if (view == View::normal_scores)
    return FeatureView(FeatureView::Table(NormalScores(read_ranks(in, features))));
  if (view == View::standardised)
    return FeatureView(FeatureView::Table(Standardised{read_scaler(in, features)}));
  if (view != View::components) return {};
  Scaler scaler = read_scaler(in, features);
  Matrix axes = read_matrix(in, "axes", features);
  if (axes.rows() == 0) in.refuse("too few components", "at least 1", "0");
  const double explained = in.not_negative("explained");
  return FeatureView(
      FeatureView::Table(PrincipalComponents{std::move(scaler), std::move(axes), explained}));
}

std::optional<FabricModel> read_cores(LineReader& in, Learner kind,
                                      const std::vector<std::string>& labels,
                                      const std::vector<std::string>& features) {
  std::vector<FabricCore> cores;
  for (std::size_t i = 0; in.ok() && i < pair_count(labels.size()); ++i)
    cores.push_back(read_core(in, features.size()));
  if (!in.ok()) return std::nullopt;
  const Reduction reduction = kind == Learner::pca   ? Reduction::pca
                              : kind == Learner::all ? Reduction::all
                                                     : Reduction::pvalue;
  return FabricModel(labels, features, reduction, std::move(cores));
}

PredictorPtr read_any(LineReader& in, Learner kind, const std::vector<std::string>& labels,
                      const std::vector<std::string>& features) {
  if (!is_cores(kind)) return read_predictor(kind, in, features.size(), labels.size());
  auto cores = read_cores(in, kind, labels, features);
  return cores ? predictor_of(std::move(*cores)) : nullptr;
}

}  // namespace

// Writes in batches: the digits of many cores take seconds, their texts gigabytes.
void write_cores(LineWriter& out, const std::vector<FabricCore>& cores) {
  constexpr std::size_t batch = 1024;
  std::vector<std::string> text;
  for (std::size_t from = 0; from < cores.size(); from += text.size()) {
    text.resize(std::min(batch, cores.size() - from));
    parallel_for(text.size(), 0, [&](std::size_t i) { text[i] = core_text(cores[from + i]); });
    for (const std::string& lines : text) out.lines(lines);
  }
}

void write_head(LineWriter& out, const LearnerHead& head) {
  out.text("learner", to_string(head.kind));
  out.text("view", to_string(head.view));
}

LearnerHead read_head(LineReader& in, int version) {
  if (version == 3) return {read_kind(in, "reduction", kinds_of_version_3), View::plain};
  const Learner kind = version < 6 ? read_kind(in, "learner", kinds_of_version_5)
                                   : read_name(in, "learner", learner_from, Learner::pvalue);
  if (is_choice(kind))
    in.refuse("choice of several learners not trained", "one learner",
              std::string(to_string(kind)));
  if (version == 4)
    return {kind, in.count("compressed", 0, 1) == 1 ? View::compressed : View::plain};
  return {kind, read_name(in, "view", view_from, View::plain)};
}

void write_learner(LineWriter& out, const TrainedLearner& learner) {
  write_view(out, learner.view());
  learner.predictor().write(out);
}

std::optional<TrainedLearner> read_learner(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           std::vector<std::string> features) {
  FeatureView view = read_view(in, head.view, features.size());
  PredictorPtr predictor =
      in.ok() ? read_any(in, head.kind, labels, view.apply(features)) : nullptr;
  if (!in.ok() || predictor == nullptr) return std::nullopt;
  return TrainedLearner(head.kind, std::move(labels), std::move(features), std::move(view),
                        std::move(predictor));
}

std::string task_text(const CoreTask& task) {
  LineWriter out;
  out.text("reduction", to_string(task.reduction));
  out.text("view", to_string(task.view));
  out.count("folds", task.fold ? 1 : 0);
  if (task.fold) out.count("fold", *task.fold);
  out.count("components", task.components);
  return out.str();
}

Result<CoreTask> task_from_text(std::string_view text) {
  LineReader in(text);
  CoreTask task{read_name(in, "reduction", reduction_from, Reduction::pvalue),
                read_name(in, "view", view_from, View::plain)};
  if (in.count("folds", 0, 1) == 1) task.fold = in.count("fold", 0, most_folds);
  task.components = in.count("components", 0, most_components);
  in.finish();
  if (!in.ok()) return pass(in.status().error(), "training task");
  return task;
}

}  // namespace weft::classifier
