"""The page in the browser: a project on disk, what is computed for it, and its tabs.

`rigdda.app.page.state` and the modules that compute do not know Panel. `server` and the modules of
the tabs do; the extra `page` installs it.
"""
