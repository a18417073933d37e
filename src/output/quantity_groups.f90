!> Groups of results files whose datasets are told what kind of quantity they hold. Here alone is decided what a dataset
!> is called, what its unit is, and by what its dimensionless values are multiplied.
module quantity_groups
   use hdf5_writing, only: hdf5_column_t, hdf5_group_t
   use kinds, only: wp
   use quantities, only: name_in, quantity_named, quantity_table, system_none, unit_of, units_t, words_in
   implicit none (type, external)
   private
   public :: quantity_group_t

   !> Of a dimensionless dataset: the unit of what `in_scene_units` says.
   character(*), parameter :: scale_unit = 'scene_units'

   type, extends(hdf5_group_t) :: quantity_group_t
      !> What its results are in
      type(units_t) :: units
      !> Dimensionless values come, which it multiplies; else they come as they are to be
      logical :: multiplies = .true.
      !> The unit of what is dimensionless is its symbol, not 1
      logical :: tells_symbols = .false.
   contains
      !> A new group in this one; the same group for values as they are to be
      procedure :: part
      procedure :: as_they_are
      !> A dataset: name and dimensionless values; quantity, as in `quantity_table`, but for whole numbers; meaning. Of
      !> {this~that} in the meaning this stands without units, that in units. Its scales are named as without units
      generic :: put => put_real, put_reals, put_table, put_integer, put_integers
      !> A list that is filled later, with values as they are to be
      procedure :: put_column, put_rows
      !> An attribute that is a number
      procedure :: put_attribute
      !> What a dataset is called here, a text about it, and the unit of what is in the units of the scene anyhow
      procedure :: named
      procedure :: worded
      procedure :: given_unit
      procedure, private :: put_real, put_reals, put_table, put_integer, put_integers, find, tell_unit
   end type quantity_group_t

contains

   function part(self, name) result(made)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      type(quantity_group_t) :: made

      made%hdf5_group_t = self%group(name)
      made%units = self%units
      made%multiplies = self%multiplies
      made%tells_symbols = self%tells_symbols
   end function part

   !> Values of several scenes: where they are dimensionless, or their scales differ, only their units tell what they
   !> are in.
   function as_they_are(self, varied) result(same)
      class(quantity_group_t), intent(in) :: self
      !> Quantities that differ from scene to scene
      character(*), intent(in), optional :: varied(:)
      type(quantity_group_t) :: same

      same%hdf5_group_t = self%hdf5_group_t
      same%units = self%units
      same%multiplies = .false.
      same%tells_symbols = self%tells_symbols
      if (.not. same%units%are_of_scene) same%units%factor = 0.0_wp
      if (.not. present(varied)) return
      ! a height of the stop from which the beam is released changes the unit of displacement
      if (any(varied == 'displacement')) same%units%factor = 0.0_wp
   end function as_they_are

   subroutine put_real(self, name, value, quantity, meaning)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), intent(in) :: value
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning

      character(:), allocatable :: unit
      real(wp) :: factor, known

      call self%find(quantity, unit, factor, known)
      call self%add(self%named(name), value*factor, unit, self%worded(meaning), in_scene_units=known)
      call self%tell_unit(name, quantity, known)
   end subroutine put_real

   subroutine put_reals(self, name, values, quantity, meaning, along, is_scale)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, intent(in) :: values(:)
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale

      character(:), allocatable :: scale, unit
      real(wp) :: factor, known

      call self%find(quantity, unit, factor, known)
      scale = ''
      if (present(along)) scale = self%named(along)
      if (self%units%are_of_scene) then
         call self%add(self%named(name), values*factor, unit, self%worded(meaning), scale, is_scale, known)
      else
         call self%add(self%named(name), values, unit, self%worded(meaning), scale, is_scale, known)
      end if
      call self%tell_unit(name, quantity, known)
   end subroutine put_reals

   !> A table of numbers. Readers in C and Python see its dimensions in reverse.
   subroutine put_table(self, name, values, quantity, meaning, along)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, intent(in) :: values(:, :)
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning
      !> The dimension scales for the first and the second index
      character(*), intent(in) :: along(2)

      character(:), allocatable :: unit
      character(64) :: scales(2)
      real(wp) :: factor, known

      call self%find(quantity, unit, factor, known)
      scales(1) = self%named(along(1))
      scales(2) = self%named(along(2))
      if (self%units%are_of_scene) then
         call self%add(self%named(name), values*factor, unit, self%worded(meaning), scales, in_scene_units=known)
      else
         call self%add(self%named(name), values, unit, self%worded(meaning), scales, in_scene_units=known)
      end if
      call self%tell_unit(name, quantity, known)
   end subroutine put_table

   subroutine put_integer(self, name, value, meaning)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: value
      character(*), intent(in) :: meaning

      call self%add(self%named(name), value, '1', self%worded(meaning))
   end subroutine put_integer

   subroutine put_integers(self, name, values, meaning, along, is_scale)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      integer, contiguous, intent(in) :: values(:)
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: along
      logical, intent(in), optional :: is_scale

      character(:), allocatable :: scale

      scale = ''
      if (present(along)) scale = self%named(along)
      call self%add(self%named(name), values, '1', self%worded(meaning), scale, is_scale)
   end subroutine put_integers

   !> A list without values yet; who fills it gives values in its unit.
   function put_column(self, name, length, quantity, meaning, is_whole, along) result(made)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Number of values
      integer, intent(in) :: length
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning
      logical, intent(in) :: is_whole
      character(*), intent(in) :: along
      type(hdf5_column_t) :: made

      character(:), allocatable :: unit
      real(wp) :: factor, known

      call self%find(quantity, unit, factor, known)
      made = self%column(self%named(name), length, unit, self%worded(meaning), is_whole, self%named(along), &
         in_scene_units=known)
      call self%tell_unit(name, quantity, known)
   end function put_column

   function put_rows(self, name, extents, quantity, meaning, along) result(made)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Values of a row, and rows
      integer, intent(in) :: extents(2)
      character(*), intent(in) :: quantity
      character(*), intent(in) :: meaning
      !> Dimension scale of the rows
      character(*), intent(in) :: along
      type(hdf5_column_t) :: made

      character(:), allocatable :: unit
      real(wp) :: factor, known

      call self%find(quantity, unit, factor, known)
      made = self%rows(self%named(name), extents, unit, self%worded(meaning), self%named(along), known)
      call self%tell_unit(name, quantity, known)
   end function put_rows

   subroutine put_attribute(self, name, value, quantity)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), intent(in) :: value
      character(*), intent(in) :: quantity

      character(:), allocatable :: unit
      real(wp) :: factor, known

      call self%find(quantity, unit, factor, known)
      call self%attribute(self%named(name), value*factor)
   end subroutine put_attribute

   pure function named(self, name)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      character(:), allocatable :: named

      named = name_in(self%units, name)
   end function named

   pure function worded(self, text)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: text
      character(:), allocatable :: worded

      worded = words_in(self%units, trim(text))
   end function worded

   pure function given_unit(self, quantity) result(unit)
      class(quantity_group_t), intent(in) :: self
      !> Empty: a number
      character(*), intent(in) :: quantity
      character(:), allocatable :: unit

      unit = '1'
      if (quantity /= '') unit = unit_of(quantity_named(quantity), self%units)
   end function given_unit

   !> What a quantity is here.
   pure subroutine find(self, quantity, unit, factor, known)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: quantity
      !> Of the dataset
      character(:), allocatable, intent(out) :: unit
      !> By which its dimensionless values are multiplied
      real(wp), intent(out) :: factor
      !> One dimensionless unit in those of the scene; 0: not known, or a number
      real(wp), intent(out) :: known

      integer :: place

      place = quantity_named(quantity)
      unit = '1'
      if (self%tells_symbols) unit = trim(quantity_table(place)%symbol)
      factor = 1.0_wp
      known = 0.0_wp
      if (quantity == 'number') return
      known = self%units%factor(place)
      if (.not. self%units%are_of_scene) return
      unit = unit_of(place, self%units)
      if (self%multiplies) factor = known
   end subroutine find

   !> Of a dimensionless dataset: the unit in which its scale is, if the scene says that.
   subroutine tell_unit(self, name, quantity, known)
      class(quantity_group_t), intent(in) :: self
      character(*), intent(in) :: name
      character(*), intent(in) :: quantity
      !> Its scale; 0: not known
      real(wp), intent(in) :: known

      if (self%units%are_of_scene .or. self%units%system == system_none .or. known <= 0.0_wp) return
      call self%attribute(scale_unit, unit_of(quantity_named(quantity), self%units), self%named(name))
   end subroutine tell_unit

end module quantity_groups
