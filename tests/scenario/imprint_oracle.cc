// Runs our imprint module on images given as text, for imprint_oracle.py.
//
//   imprint_oracle features SIGMAS NOISE ORIENTATION < IMAGES
//   imprint_oracle experiments SIGMAS RULE < IMAGES
//
// SIGMAS: 0,1,2.5; NOISE: gradient or literal; ORIENTATION: circular or linear. IMAGES: rows, cols
// and their values, one image after the other. Prints one line of ten numbers a scale and image, 17
// digits. For experiments each image follows its class and object. Prints one line per form and
// experiment: columns, separable or not, experiment, whether it converged, rounds, correct, wrong
// rows.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

#include "classifier/imprint/experiments.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/scale_features.hpp"
#include "classifier/learners/linear_rule.hpp"

namespace {

using namespace weft::classifier::imprint;

template <class T>
T or_exit(weft::Result<T>&& result) {
  if (result) return std::move(*result);
  std::cerr << to_string(result.error()) << "\n";
  std::exit(1);
}

bool read_image(Image& out) {
  std::size_t rows = 0, cols = 0;
  if (!(std::cin >> rows >> cols)) return false;
  out.assign(rows, cols);
  for (double& value : out.data()) std::cin >> value;
  return true;
}

std::vector<double> sigmas_of(const char* text) {
  std::vector<double> out;
  std::stringstream sigmas(text);
  for (std::string cell; std::getline(sigmas, cell, ',');) out.push_back(std::stod(cell));
  return out;
}

void print_features(const ScaleOptions& options) {
  ScaleFeatures features = or_exit(ScaleFeatures::make(options));
  for (Image image; read_image(image);) {
    std::size_t at = 0;
    for (const double value : or_exit(features.extract(image)))
      std::printf("%.17g%c", value, ++at % features_per_scale == 0 ? '\n' : ' ');
  }
}

void print_experiments(const std::vector<double>& sigmas, std::string_view rule_name) {
  std::vector<Imprint> imprints;
  for (Imprint one; std::cin >> one.label >> one.object && read_image(one.image);) {
    one.file = std::to_string(imprints.size());
    imprints.push_back(one);
  }
  const weft::classifier::Learner rule = or_exit(weft::classifier::learner_from(rule_name));
  for (const Form form : {Form::full, Form::brief}) {
    ScaleOptions options;
    options.sigmas = sigmas;
    options.form = form;
    const auto matrix = or_exit(build_matrix(imprints, options));
    const Classes classes = find_classes(matrix.labels);
    const auto hull = or_exit(
        weft::classifier::separability(matrix.values, classes.of_row, classes.names.size()));
    for (const Experiment experiment : all_experiments) {
      const auto out = or_exit(run_experiment(matrix, experiment, rule));
      std::printf("%s,%s,%s,%d,%zu,%zu", to_string(form).data(), to_string(hull.verdict).data(),
                  to_string(experiment).data(), out.converged ? 1 : 0, out.most_rounds,
                  out.correct);
      for (const std::size_t row : out.wrong) std::printf(",%zu", row);
      std::printf("\n");
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string command = argc > 1 ? argv[1] : "";
  std::ios::sync_with_stdio(false);
  if (command == "features" && argc == 5) {
    ScaleOptions options;
    options.sigmas = sigmas_of(argv[2]);
    if (std::string(argv[3]) == "literal") options.noise = NoiseForm::literal;
    if (std::string(argv[4]) == "linear") options.orientation = OrientationSpread::linear;
    print_features(options);
  } else if (command == "experiments" && argc == 4) {
    print_experiments(sigmas_of(argv[2]), argv[3]);
  } else {
    std::fprintf(stderr, "usage: features SIGMAS NOISE ORIENTATION | experiments SIGMAS RULE\n");
    return 2;
  }
  return 0;
}
