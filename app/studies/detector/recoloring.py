"""Random changes of a training picture's colours (Hwang 2024, section 3.2.2)."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class RecoloringParameters:
    """How far the colours change. Shares are probabilities."""

    color_share: float = 0.5  # pictures with another hue and saturation; choice
    max_hue: float = 25.0  # degrees; Hwang's
    max_saturation: float = 0.25  # relative change; Hwang's
    exposure_share: float = 0.5  # pictures with another gamma and gain; choice
    max_log_gamma: float = 0.4  # natural logarithm of the exponent; choice: changes middle grey by about 25 %
    max_gain: float = 0.25  # relative change; Hwang's
    blur_share: float = 0.3  # choice
    blur: tuple[float, float] = (0.3, 1.25)  # px, standard deviation; Hwang's 2.5 px of the camera's own picture
    noise_share: float = 0.3  # choice
    max_noise: float = 0.05  # standard deviation over the full range; Hwang's


def recolored(
    image: NDArray[np.uint8], rng: np.random.Generator, parameters: RecoloringParameters = RecoloringParameters()
) -> NDArray[np.uint8]:
    """The picture (h, w, 3) with another hue, saturation, brightness and exposure; blur; noise."""
    if rng.random() < parameters.color_share:
        hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV).astype(np.float32)
        hsv[..., 0] = (hsv[..., 0] + rng.uniform(-parameters.max_hue, parameters.max_hue) / 2) % 180
        hsv[..., 1] *= rng.uniform(1 - parameters.max_saturation, 1 + parameters.max_saturation)
        image = cv2.cvtColor(np.clip(hsv, 0, 255).astype(np.uint8), cv2.COLOR_HSV2RGB)
    if rng.random() < parameters.exposure_share:
        gamma = np.exp(rng.uniform(-parameters.max_log_gamma, parameters.max_log_gamma))
        gain = rng.uniform(1 - parameters.max_gain, 1 + parameters.max_gain)
        table = np.clip(255 * gain * (np.arange(256) / 255) ** gamma, 0, 255).astype(np.uint8)
        image = np.asarray(cv2.LUT(image, table), np.uint8)
    if rng.random() < parameters.blur_share:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), rng.uniform(*parameters.blur)), np.uint8)
    if rng.random() < parameters.noise_share:
        deviation = rng.uniform(0, parameters.max_noise) * 255
        noisy = image + rng.normal(0, deviation, image.shape).astype(np.float32)
        image = np.clip(noisy, 0, 255).astype(np.uint8)
    return image
