// Writes the inputs where fuzzing starts, with the program's own writers and from the golden
// vectors:
//   fuzz_corpus FOLDER [small]   makes FOLDER/model_file, csv, hdf5 and one folder for each wire;
//   small: without a whole HDF5 file, as committed in corpus/

#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/dataset/hdf5_file.hpp"
#include "tests/fuzz/samples.hpp"

namespace weft::fuzz {
namespace {

void write(const std::filesystem::path& path, std::string_view text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

bool write_models(const std::filesystem::path& folder) {
  using classifier::Learner;
  using classifier::View;
  for (const auto& [learner, view] :
       {std::pair{Learner::pvalue, View::plain}, std::pair{Learner::pca, View::plain},
        std::pair{Learner::all, View::compressed}, std::pair{Learner::lda, View::compressed},
        std::pair{Learner::svc, View::ranked}}) {
    const auto model = sample_model(learner, view);
    std::ostringstream text;
    if (!model || !classifier::save_model(*model, text)) return false;
    write(folder / std::string(classifier::to_string(learner)), text.view());
  }
  return true;
}

/// There is no writer of trials as text: the forms that the reader documents.
void write_tables(const std::filesystem::path& folder) {
  write(folder / "trial", "t_s,phase,ch1,ch2\n0,S,1,2\n0.027,P,1,2\n0.054,M,3,4.5\n0.1,E,1e3,2\n");
  write(folder / "motion_only", "t_s,ch1\n0,1\n1,2\n");
  write(folder / "excel", "\xEF\xBB\xBF\"t_s\", \"ch1\" ,ch2\r\n\r\n0,\"1\",2\r\n-1e-3,-,3\r\n");
  write(folder / "manifest", "file,label,group\nno.csv,denim,1\n\"a \"\"b\"\".csv\",silk,2\n");
}

/// Edits of every kind, of objects throughout the file, and a few altered bytes.
bool write_datasets(const std::filesystem::path& folder, bool whole) {
  std::filesystem::create_directories(folder);
  for (const int operation : {0, 1, 2, 3, 4})
    for (const int object : {0, 7, 14, 21, 28})
      write(folder / ("edit" + std::to_string(operation) + "_" + std::to_string(object)),
            std::string{'E', static_cast<char>(operation), static_cast<char>(object), 3, 1, 2});
  for (const int high : {0, 10, 30, 60})
    write(folder / ("bytes" + std::to_string(high)),
          std::string{'B', 0, static_cast<char>(high), 8, 1});
  return !whole || daemon::write_hdf5(sample_dataset(), folder / "dataset").has_value();
}

std::string from_hex(const std::string& text) {
  std::string out;
  std::istringstream words(text);
  for (std::string word; words >> word;)
    out.push_back(static_cast<char>(std::stoi(word, nullptr, 16)));
  return out;
}

/// The bytes of every golden vector of a wire, alone and one behind the other; with and without the
/// bytes in front that choose the pieces.
void write_vectors(const std::filesystem::path& vectors, const std::filesystem::path& folder) {
  const std::string pieces{'\3', '\1', '\7', '\2'};
  std::string all;
  for (const auto& file : std::filesystem::directory_iterator(vectors)) {
    std::ifstream in(file.path());
    const auto vector = nlohmann::json::parse(in, nullptr, false);
    if (!vector.is_object() || !vector.contains("hex")) continue;
    const std::string bytes = from_hex(vector["hex"].get<std::string>());
    const std::string name = file.path().stem().string();
    write(folder / name, bytes);
    write(folder / (name + "_pieces"), pieces + bytes);
    all += bytes;
  }
  write(folder / "all_pieces", pieces + all);
}

void write_wires(const std::filesystem::path& folder) {
  for (const auto& wire : std::filesystem::directory_iterator(WEFT_PROTOCOLS_DIR))
    if (std::filesystem::is_directory(wire.path() / "vectors"))
      write_vectors(wire.path() / "vectors", folder / wire.path().filename());
}

}  // namespace
}  // namespace weft::fuzz

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "fuzz_corpus FOLDER [small]\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  weft::fuzz::write_tables(folder / "csv");
  weft::fuzz::write_wires(folder);
  if (weft::fuzz::write_models(folder / "model_file") &&
      weft::fuzz::write_datasets(folder / "hdf5", argc == 2))
    return 0;
  std::cerr << "fuzz_corpus: cannot make the samples\n";
  return 1;
}
