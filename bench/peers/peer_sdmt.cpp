// SPDX-License-Identifier: Apache-2.0
// Our own engine, asked as peer.h says:  peer_sdmt MODEL
#include <map>
#include <memory>

#include "peer.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/nn/sgd.h"
#include "sdmt/reid/model_file.h"

namespace {

using namespace sdmt;

/// One step of SGD with momentum; the gradient of the loss is the embedding itself.
void train_step(reid::EmbeddingNetwork& network, nn::Optimizer& optimizer, const nn::Tensor& x,
                bool frozen, nn::Tensor& feature_gradient) {
  optimizer.zero_grad();
  const nn::Mode trunk_mode = frozen ? nn::Mode::inference : nn::Mode::training;
  const nn::Tensor& y =
      network.head().forward(network.trunk().forward(x, trunk_mode), nn::Mode::training);
  network.head().backward(y, frozen ? nullptr : &feature_gradient);
  if (!frozen) network.trunk().backward(feature_gradient);
  optimizer.step();
  network.parameters_changed();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string path = argv[1];
  reid::Model model = reid::load_model(path);
  std::map<int, nn::Tensor> inputs;
  const auto input = [&](int batch) -> const nn::Tensor& {
    if (!inputs.contains(batch)) inputs[batch] = peers::patches(batch);
    return inputs[batch];
  };
  nn::Tensor feature_gradient;
  peers::serve([&](const std::string& what, int batch, const std::string& mode) {
    const nn::Tensor& x = input(batch);
    if (what == "embed") {
      std::printf("%.4f\n",
                  peers::milliseconds([&] { model.network.forward(x, nn::Mode::inference); }));
    } else if (what == "values") {
      const nn::Tensor& y = model.network.forward(x, nn::Mode::inference);
      peers::print_values(y.image(0), y.image(batch - 1), y.shape().c);
    } else if (what == "train") {
      static reid::Model trained = reid::load_model(path);
      const bool frozen = mode == "frozen";
      auto parameters = trained.network.head().named_parameters();
      if (!frozen) {
        for (const auto& named : trained.network.trunk().named_parameters()) {
          parameters.push_back(named);
        }
      }
      static nn::Sgd all(parameters, {.learning_rate = 1e-6});
      static nn::Sgd head(trained.network.head().named_parameters(), {.learning_rate = 1e-6});
      std::printf("%.4f\n", peers::milliseconds([&] {
                    train_step(trained.network, frozen ? head : all, x, frozen, feature_gradient);
                  }));
    } else {
      return false;
    }
    return true;
  });
  return 0;
}
