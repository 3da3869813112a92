"""What several test files share lies in `support`; its assertions tell what they compared, like a test's own."""

import pytest

pytest.register_assert_rewrite("support")
