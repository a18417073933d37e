!> The model of a run: that of its beam and, after the degrees of freedom of the beam, the extra degrees of freedom of
!> the run, such as those of bodies, with entries on the diagonals of K and M alone. Contacts, whose rows have entries
!> for these degrees of freedom, couple them to the beam.
module run_models
   use beam_model, only: beam_model_t, recorded_point_t
   use kinds, only: lambda1_power4, wp
   use run_settings, only: extra_dof_t, run_settings_t, stop_settings_t, stops_of
   use skyline_matrix, only: skyline_t
   implicit none (type, external)
   private
   public :: complete_model, beam_alone

contains

   !> Complete the model of a beam to that of a run: append the extra degrees of freedom, and let the contacts of bodies
   !> refer to them.
   pure subroutine complete_model(settings, model)
      type(run_settings_t), intent(in) :: settings
      !> On entry the beam alone
      type(beam_model_t), intent(inout) :: model

      type(stop_settings_t), allocatable :: stops(:)
      integer :: k

      if (.not. allocated(settings%extra_dofs)) return
      allocate (stops, source=stops_of(settings))
      associate (order => model%mass%order)
         do k = 1, size(stops)
            if (stops(k)%partner == 0) cycle
            if (stops(k)%is_of_base) model%stop_dofs(k) = order + stops(k)%partner
            if (.not. stops(k)%is_of_base) model%partner_dofs(k) = order + stops(k)%partner
         end do
      end associate
      call set_extra(settings%extra_dofs, model)
   end subroutine complete_model

   !> A model without extra degrees of freedom. Its stops may still refer to them.
   pure type(beam_model_t) function beam_alone(model) result(beam)
      type(beam_model_t), intent(in) :: model

      beam = model
      if (size(model%extra) > 0) call set_extra(model%extra(:0), beam)
   end function beam_alone

   !> Replace the extra degrees of freedom of a model.
   pure subroutine set_extra(extra, model)
      type(extra_dof_t), intent(in) :: extra(:)
      type(beam_model_t), intent(inout) :: model

      integer :: i

      associate (before => model%mass%order - size(model%extra))
         model%points = [(recorded_point_t(before + i, extra(i)%position, extra(i)%origin, extra(i)%rest), &
            i=1, size(extra))]
         call replace_end(before, lambda1_power4*extra%mass*extra%square, model%stiffness)
         call replace_end(before, extra%mass, model%mass)
      end associate
      model%extra = extra
      if (allocated(model%lumped_mass)) deallocate (model%lumped_mass)
      if (allocated(model%own_rate)) deallocate (model%own_rate)
      if (size(extra) == 0) return
      associate (beam => model%mass%order - size(extra))
         model%lumped_mass = [spread(0.0_wp, 1, beam), extra%mass]
         if (any(extra%rate >= 0.0_wp)) model%own_rate = [spread(-1.0_wp, 1, beam), extra%rate]
      end associate
   end subroutine set_extra

   !> Replace the last columns of a matrix by those of a diagonal matrix.
   pure subroutine replace_end(before, diagonal, matrix)
      !> Number of columns before them
      integer, intent(in) :: before
      real(wp), intent(in) :: diagonal(:)
      type(skyline_t), intent(inout) :: matrix

      integer :: i

      associate (entries => matrix%diagonal(before))
         matrix%values = [matrix%values(:entries), diagonal]
         matrix%diagonal = [matrix%diagonal(:before), [(entries + i, i=1, size(diagonal))]]
      end associate
      matrix%first_row = [matrix%first_row(:before), [(before + i, i=1, size(diagonal))]]
      matrix%order = before + size(diagonal)
   end subroutine replace_end

end module run_models
