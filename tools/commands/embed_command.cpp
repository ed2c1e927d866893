// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "cli/command.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/shipped_files.h"
#include "sdmt/media/image_file.h"
#include "sdmt/reid/camera_means.h"
#include "sdmt/reid/embedder.h"

namespace sdmt::tools {

namespace fs = std::filesystem;

namespace {

struct EmbedOptions {
  std::string model;
  std::string output;
  std::vector<std::string> images;
  bool centre = false;
};

// Decodes all files, by all threads. The error of the first bad one, in their order, is thrown.
std::vector<image::Image> read_all(std::span<const fs::path> paths) {
  std::vector<image::Image> images;
  auto decoded = media::read_images(paths);
  for (std::size_t i = 0; i < paths.size(); ++i) {
    images.push_back(decoded[i] ? std::move(*decoded[i]) : media::read_image(paths[i]));
  }
  return images;
}

void run(const EmbedOptions& options) {
  std::vector<NamedPath> inputs{{"--model", options.model}};
  for (const std::string& image : options.images) inputs.push_back({"IMAGE", image});
  check_outputs(inputs, {{"--output", options.output}});
  reid::Embedder embedder(
      reid::load_model(options.model.empty() ? find_default_model() : fs::path(options.model)));

  const std::vector<fs::path> paths(options.images.begin(), options.images.end());
  constexpr std::size_t kAtOnce = 160;  // pictures in memory
  nn::Tensor embeddings({static_cast<int>(paths.size()), 1, 1, embedder.dimension()});
  Progress progress("embed", static_cast<std::int64_t>(paths.size()), "images");
  for (std::size_t first = 0; first < paths.size(); first += kAtOnce) {
    const auto piece = std::span(paths).subspan(first, std::min(kAtOnce, paths.size() - first));
    const std::vector<image::Image> images = read_all(piece);
    std::vector<image::Crop> crops;
    crops.reserve(images.size());
    for (const image::Image& image : images) {
      crops.push_back({image.view(), {0, 0, 1.0 * image.width, 1.0 * image.height}});
    }
    image::DescriptorRows rows;
    embedder.describe(crops, rows);
    for (std::size_t i = 0; i < piece.size(); ++i) {
      if (rows.valid[i] == 0) {
        throw std::invalid_argument(fmt::format("{}: is {} x {} pixels, expected at least 2 x 2",
                                                piece[i].string(), images[i].width,
                                                images[i].height));
      }
    }
    std::copy(rows.values.begin(), rows.values.end(), embeddings.image(static_cast<int>(first)));
    progress.update(static_cast<std::int64_t>(first + piece.size()));
  }

  if (options.centre) {
    reid::subtract_camera_means(embeddings, std::vector<int>(paths.size(), 1));
  }

  io::SafetensorsWriter writer;
  writer.set_metadata("images",
                      nlohmann::json(options.images)
                          .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  writer.add("embeddings", {paths.size(), static_cast<std::size_t>(embedder.dimension())},
             embeddings.values());
  writer.write(options.output);
}

}  // namespace

void add_embed_command(CLI::App& app) {
  auto options = std::make_shared<EmbedOptions>();
  CLI::App* command =
      app.add_subcommand("embed", "Turn images of pedestrians into feature vectors");
  command->add_option("--model", options->model, "Model file [the shipped one]")->type_name("FILE");
  command
      ->add_option("--output", options->output,
                   "safetensors file to write: `embeddings` [images,128 or what the model makes] "
                   "float32, rows in the "
                   "order of the images")
      ->required()
      ->type_name("FILE");
  command->add_flag(
      "--centre", options->centre,
      "The images are of one camera, of dozens of people: take away the mean of their "
      "vectors, its light and background");
  command->add_option("IMAGE", options->images, "JPEG or PNG files, each one crop")->required();
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
