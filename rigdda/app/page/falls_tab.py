import panel as pn


class FallsTab:
    title = "Falls"

    def __init__(self, page):
        self.panel = pn.Column("falls")

    def show(self):
        pass

    def tick(self):
        pass
