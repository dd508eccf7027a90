"""Human motion from body-worn sensors. Importing the package enables 64-bit JAX."""

import jax

jax.config.update("jax_enable_x64", True)
