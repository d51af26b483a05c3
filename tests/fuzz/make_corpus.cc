// Writes the initial inputs of the fuzz targets with the program's own writers and from the golden
// vectors:
//   fuzz_corpus FOLDER [small]   makes FOLDER/model_file, live_model, other_models, csv,
//   imprint_file, hdf5, recordings, rdt_page and one folder for each wire; small: without a whole
//   HDF5 file, as committed in corpus/

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "protocols/rdt/page.hpp"
#include "tests/fuzz/checksum.hpp"
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
       {std::pair{Learner::pvalue, View::plain}, std::pair{Learner::pca, View::normal_scores},
        std::pair{Learner::all, View::compressed}, std::pair{Learner::lda, View::compressed},
        std::pair{Learner::svc, View::ranked}, std::pair{Learner::trees, View::plain}}) {
    const auto model = sample_model(learner, view);
    std::ostringstream text;
    if (!model || !classifier::save_model(*model, text)) return false;
    write(folder / std::string(classifier::to_string(learner)), text.view());
  }
  return true;
}

// Keeps one tree of each class of a booster's hundred: a seed should be small.
std::string with_few_trees(const std::string& model) {
  constexpr std::string_view keyword = "\nbooster ";
  const std::size_t at = model.find(keyword);
  if (at == std::string::npos) return model;
  const std::size_t from = at + keyword.size();
  const std::size_t end = model.find('\n', from);
  auto booster = nlohmann::json::parse(model.substr(from, end - from));
  auto& trees = booster["learner"]["gradient_booster"]["model"];
  const auto all = std::exchange(trees["trees"], nlohmann::json::array());
  const auto of_tree = std::exchange(trees["tree_info"], nlohmann::json::array());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (of_tree[i] != trees["tree_info"].size()) continue;
    trees["trees"].push_back(all[i]);
    trees["trees"].back()["id"] = trees["tree_info"].size();
    trees["tree_info"].push_back(of_tree[i]);
  }
  trees["gbtree_model_param"]["num_trees"] = std::to_string(trees["trees"].size());
  trees["gbtree_model_param"]["num_parallel_tree"] = "1";
  return with_checksum(model.substr(0, from) + booster.dump() + model.substr(end));
}

bool write_other_models(const std::filesystem::path& folder) {
  namespace vibro = classifier::vibro;
  for (const auto learner :
       {classifier::Learner::lda, classifier::Learner::svc, classifier::Learner::pvalue}) {
    const auto model = sample_imprint_model(learner);
    std::ostringstream text;
    if (!model || !classifier::save_model(*model, text)) return false;
    write(folder / ("imprint_" + std::string(classifier::to_string(learner))), text.view());
  }
  for (const classifier::Learner learner : classifier::all_learners()) {
    if (!classifier::is_available(learner) || classifier::is_choice(learner)) continue;
    const auto model = sample_recording_model(learner);
    std::ostringstream text;
    if (!model || !classifier::save_model(*model, text)) return false;
    write(folder / ("recording_" + std::string(classifier::to_string(learner))),
          with_few_trees(text.str()));
  }
  return true;
}

bool write_live_models(const std::filesystem::path& folder) {
  auto model = sample_live_model();
  for (const char* name : {"stages", "one"}) {
    std::ostringstream text;
    if (!model || !classifier::save_staged(*model, text)) return false;
    write(folder / name, text.view());
    model->stages.erase(model->stages.begin() + 1, model->stages.end());
  }
  return true;
}

/// The program has no writer of trials as text: these are the forms that the reader documents.
void write_tables(const std::filesystem::path& folder) {
  write(folder / "trial", "t_s,phase,ch1,ch2\n0,S,1,2\n0.027,P,1,2\n0.054,M,3,4.5\n0.1,E,1e3,2\n");
  write(folder / "motion_only", "t_s,ch1\n0,1\n1,2\n");
  write(folder / "excel", "\xEF\xBB\xBF\"t_s\", \"ch1\" ,ch2\r\n\r\n0,\"1\",2\r\n-1e-3,-,3\r\n");
  write(folder / "icub20",
        "sample,label,fold,t,tx1,tx2,tx3,tx4,tx5,tx6,tx7,tx8,tx9,tx10\n"
        "0,16,0,0,0.8,0,2.3,2.5,45.4,105.6,38.7,1.6,0,0.6\n0,16,0,1,1.4,1.3,0,0,5,52.5,0,0,0,0\n"
        "1,3,2,0,0,0,0,1,2,3,4,5,6,7\n1,3,2,1,0,0,0,1,2,3,4,5,6,7\n");
  write(folder / "manifest", "file,label,group\nno.csv,denim,1\n\"a \"\"b\"\".csv\",silk,2\n");
  write(folder / "imprints",
        "# of today\n# label,group,0,1,2,3\n\"a, b\",o1,+1,2,3,4\n#c,o2,5,6,7,8");
  write(folder / "tabs", "1.5\t\t3\r\n4.5 5\t6\r\n");
}

/// Each form of an imprint, small.
void write_images(const std::filesystem::path& folder) {
  write(folder / "text", "# rows\n1,2.5,3\n4,5,-6e1\n\n7,8,9\n");
  write(folder / "blanks", "1 2\n3\t4\n");
  write(folder / "plain_map", "P2 # comment\n3 3\n127\n1 2 3\n4 127 6\n7 8 9\n");
  write(folder / "grey_map", "P5\n4 3\n255\nabcdefghijkl");
  write(folder / "wide_map", "P5 2 2 1000\n\x01\x02\x01\x03\x01\x04\x01\x05");
  using namespace std::string_view_literals;
  const std::string body =
      "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 4), }\nabcdefghijkl";
  write(folder / "array", std::string("\x93NUMPY\x01\x00\x3c\x00"sv) + body);
  const std::string wide = "{'descr': '<f8', 'fortran_order': True, 'shape': (1, 2), }\n";
  write(folder / "doubles", std::string("\x93NUMPY\x01\x00\x3b\x00"sv) + wide + "abcdefghABCDEFGH");
}

/// Edits of every kind, of objects throughout the file, and a few altered bytes.
void write_edits(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const int operation : {0, 1, 2, 3, 4})
    for (const int object : {0, 7, 14, 21, 28})
      write(folder / ("edit" + std::to_string(operation) + "_" + std::to_string(object)),
            std::string{'E', static_cast<char>(operation), static_cast<char>(object), 3, 1, 2});
  for (const int high : {0, 10, 30, 60})
    write(folder / ("bytes" + std::to_string(high)),
          std::string{'B', 0, static_cast<char>(high), 8, 1});
}

bool write_datasets(const std::filesystem::path& folder, bool whole) {
  write_edits(folder);
  return !whole || daemon::write_hdf5(sample_dataset(), folder / "dataset").has_value();
}

bool write_recordings(const std::filesystem::path& folder, bool whole) {
  write_edits(folder);
  return !whole || daemon::write_recordings(sample_recordings(), folder / "recordings").has_value();
}

std::string from_hex(const std::string& text) {
  std::string out;
  std::istringstream words(text);
  for (std::string word; words >> word;)
    out.push_back(static_cast<char>(std::stoi(word, nullptr, 16)));
  return out;
}

/// The bytes of every golden vector of a wire, alone and all joined; with and without the leading
/// bytes that choose the pieces.
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

/// The pages of a Net F/T box, first the documented minimal one (device-facts.md, Net F/T pages):
/// bare, and as replies with and without their length and in chunks. Also requests. The leading
/// bytes choose the pieces.
void write_pages(const std::filesystem::path& folder) {
  namespace rdt = protocols::rdt;
  const std::string pieces{'\3', '\1', '\7', '\2'};
  const auto put = [&](const std::string& name, const std::string& text) {
    write(folder / name, pieces + text);
  };
  const std::string minimal =
      "<netft><prodname>Net F/T</prodname><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>"
      "<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu></netft>";
  for (const auto& [name, page] :
       {std::pair{"minimal", minimal},
        {"settings", rdt::encode(rdt::SettingsPage{})},
        {"calibration", rdt::encode(rdt::CalibrationPage{"FT12288", 1e6, 1e6})}}) {
    const std::string word(name);
    put(word, page);
    put(word + "_length", rdt::http_reply(200, "text/xml", page));
    put(word + "_old", "HTTP/1.0 200 OK\r\nServer: x\r\n\r\n" + page + "\r\n");
    std::ostringstream size;
    size << std::hex << page.size();
    put(word + "_chunked", "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n" + size.str() +
                               "\r\n" + page + "\r\n0\r\n\r\n");
  }
  put("missing", rdt::http_reply(404, "text/plain", "no such page"));
  put("get", rdt::http_get(rdt::settings_path, "192.168.1.1"));
  put("query", rdt::http_get("/comm.cgi?comrdtrate=500&x=1", "box"));
}

/// The word between the first two `quote`s of a line, or nothing.
std::string between(const std::string& line, char quote) {
  const std::size_t from = line.find(quote);
  const std::size_t to = from == std::string::npos ? from : line.find(quote, from + 1);
  return to == std::string::npos ? std::string() : line.substr(from + 1, to - from - 1);
}

nlohmann::json value_of(const std::string& row) {
  if (row.find("| integer") != std::string::npos) return 1000;
  if (row.find("| number") != std::string::npos) return 2.5;
  if (row.find("| boolean") != std::string::npos) return true;
  if (row.find("| array") != std::string::npos) return {"run:*", "rig"};
  return "R-000001";
}

std::string request_line(const std::string& method, const nlohmann::json& params) {
  return nlohmann::json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}
             .dump() +
         "\n";
}

/// The examples of docs/reference/api.md, and a request of every method in its tables, each after
/// session.open; from an admin on the Unix socket and from TCP.
void write_lines(const std::filesystem::path& page, const std::filesystem::path& folder) {
  const std::string opening =
      request_line("session.open", {{"client", "seed"}, {"protocol", "1.x"}});
  const auto put = [&](std::string name, const std::string& lines) {
    std::ranges::replace(name, '/', '_');  // for "$/cancel"
    write(folder / name, std::string{3, 0, 0, 0} + lines);
    write(folder / (name + "_tcp"), std::string{4, 5, 1, 9} + lines);
  };
  std::ifstream in(page);
  std::string method, all = opening;
  nlohmann::json params = nlohmann::json::object();
  int example = 0;
  const auto end_method = [&] {
    if (method.empty()) return;
    put(method, opening + request_line(method, params));
    all += request_line(method, params);
    params = nlohmann::json::object();
  };
  for (std::string line; std::getline(in, line);) {
    for (std::size_t at = line.find("'{"); at != std::string::npos; at = line.find("'{", at + 1))
      put("example" + std::to_string(example++), opening + between(line.substr(at), '\'') + "\n");
    if (line.starts_with("### ")) {
      end_method();
      method = line.substr(4);
    }
    if (!method.empty() && line.starts_with("| `")) params[between(line, '`')] = value_of(line);
  }
  end_method();
  put("halt", "!halt\n" + opening);
  put("key_twice",
      opening + R"({"jsonrpc":"2.0","id":1,"method":"run.get","params":{"run":"a","run":"b"}})"
                "\n");
  put("bound",
      opening + request_line("recipe.check",
                             {{"recipe", "m1"}, {"parameters", {{"force_N", 3}, {"n", "two"}}}}));
  put("all", all);
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
  weft::fuzz::write_images(folder / "imprint_file");
  weft::fuzz::write_wires(folder);
  weft::fuzz::write_pages(folder / "rdt_page");
  weft::fuzz::write_lines(WEFT_API_PAGE, folder / "rpc_lines");
  if (weft::fuzz::write_models(folder / "model_file") &&
      weft::fuzz::write_live_models(folder / "live_model") &&
      weft::fuzz::write_other_models(folder / "other_models") &&
      weft::fuzz::write_datasets(folder / "hdf5", argc == 2) &&
      weft::fuzz::write_recordings(folder / "recordings", argc == 2))
    return 0;
  std::cerr << "fuzz_corpus: cannot make the samples\n";
  return 1;
}
