#include "daemon/apps/weft/model_imprints.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "classifier/imprint/imprint_model.hpp"
#include "daemon/apps/weft/answer_text.hpp"
#include "daemon/apps/weft/classify_command.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/standard_input.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

namespace ci = classifier::imprint;

struct LoadedImprints {
  BenchKind bench = BenchKind::unknown;
  ci::TaxelGrid grid;
  std::vector<ci::Imprint> imprints;
};

Result<LoadedImprints> of_image(const std::filesystem::path& path) {
  auto image = read_image(path);
  if (!image) return pass(image.error());
  const ci::TaxelGrid grid{image->rows(), image->cols()};
  return LoadedImprints{BenchKind::unknown, grid, {{std::move(*image), path.string(), {}, {}}}};
}

Result<LoadedImprints> load_imprints(const std::filesystem::path& path, std::istream* in) {
  if (path != "-" && path.extension() != ".h5") return of_image(path);
  const auto dataset = path == "-" ? trials_from(in) : open_dataset(path);
  if (!dataset) return pass(dataset.error());
  auto imprints = extract_imprints(*dataset);
  if (!imprints) return pass(imprints.error());
  const auto grid = find_grid(*dataset, *imprints);
  if (!grid) return pass(grid.error());
  return LoadedImprints{dataset->info.kind, *grid, std::move(*imprints)};
}

}  // namespace

Result<int> run_classify_imprints(const ClassifyArgs& args, Console& console) {
  const auto kind = classifier::vote_kind_from(args.vote);
  if (!kind) return pass(kind.error(), "--vote");
  std::ifstream in(args.model, std::ios::binary);
  const auto model = ci::load_imprint_model(in);
  if (!model) return pass(model.error(), args.model.string());
  const auto loaded = load_imprints(args.trials, console.in);
  if (!loaded) return pass(loaded.error(), args.trials.string());
  const auto answers = ci::classify_imprints(*model, loaded->grid, loaded->imprints,
                                             {*kind, args.shortlist, nullptr});
  if (!answers) return pass(answers.error(), args.trials.string());
  std::string text = bench_banner(loaded->bench) + trained_banner(model->provenance);
  std::vector<PredictedTrial> list;
  for (std::size_t i = 0; i < answers->size(); ++i) {
    list.push_back({loaded->imprints[i].file, loaded->imprints[i].label, (*answers)[i]});
    text += answer_line(model->learner, list.back());
  }
  print(console, text,
        {{"command", "classify"},
         {"kind", "imprints"},
         {"model", args.model.string()},
         {"model_bench", model->provenance.bench},
         {"learner", classifier::to_string(model->learner.kind())},
         {"bench", to_string(loaded->bench)},
         {"vote", args.vote},
         {"imprints", answers_json(model->learner, model->postprocessing.has_value(), list)}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
