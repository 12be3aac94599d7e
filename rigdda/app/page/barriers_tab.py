import panel as pn


class BarriersTab:
    title = "Barriers"

    def __init__(self, page):
        self.panel = pn.Column("barriers")

    def show(self):
        pass

    def tick(self):
        pass
